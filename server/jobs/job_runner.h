#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

#include "core/numerics/progress.h"
#include "server/jobs/job_registry.h"
#include "server/scheduling/worker_pool.h"

namespace shaped::server {

struct JobLimits {
  int running = 1;           ///< jobs at a time, >= 1
  std::size_t waiting = 64;  ///< jobs that wait, >= 1
  int threads = 1;           ///< of each job's TBB arena, >= 1
};

/// Runs jobs in threads of their own, beside the workers that serve requests, each in an arena of bounded size.
class JobRunner {
 public:
  /// Does the work; throws to fail. Returns with outcome kCancelled when the token fired.
  using Work = std::function<JobResult(const ProgressSink&, std::stop_token)>;

  JobRunner(JobRegistry& registry, const JobLimits& limits);
  /// Cancels what runs and what waits, and waits until it has ended.
  ~JobRunner();
  JobRunner(const JobRunner&) = delete;
  JobRunner& operator=(const JobRunner&) = delete;

  /// Registers the job and queues its work. Throws Busy when too many wait.
  JobRecord start(const std::string& model_name, const std::string& dataset, Work work);
  /// Asks a job to stop: one that waits ends at once, one that runs soon. Throws NotFound.
  JobRecord cancel(const std::string& job);
  /// Asks all jobs to stop, without waiting for them.
  void cancelAll();

 private:
  void run(const std::string& id, const Work& work, std::stop_token stop);
  void forget(const std::string& id);

  JobRegistry& registry_;
  const JobLimits limits_;
  std::mutex mutex_;
  std::map<std::string, std::stop_source> stops_;  // of jobs that have not ended
  WorkerPool pool_;                                // last: its threads use what stands above
};

}  // namespace shaped::server
