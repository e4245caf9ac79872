#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/numerics/progress.h"
#include "server/jobs/job_input.h"
#include "server/jobs/job_news.h"
#include "server/jobs/job_registry.h"

namespace shaped::server {

struct JobLimits {
  int running = 1;           ///< jobs at a time, >= 1
  std::size_t waiting = 64;  ///< jobs that wait, >= 1
  int threads = 1;           ///< of each job's TBB arena, >= 1
  int crashes = 3;           ///< processes that may die over one job without a checkpoint in between, >= 1
  JobRetention retention;
};

/// What the work of a job is given.
struct JobRun {
  JobRecord job;                 ///< as it was when it was claimed
  std::filesystem::path folder;  ///< of this job alone: input, checkpoints, result (job_input.h)
  ProgressSink progress;
  std::stop_token stop;                                   ///< cancelled, or the daemon is leaving
  std::function<void(const std::string& stage)> resumed;  ///< it goes on from a checkpoint of this stage
  std::function<void()> checkpointed;                     ///< it has kept a checkpoint of this run
  std::function<void(const JobResult& so_far)> solved;    ///< the solver has ended; call before publishing
  /// What those who watch the job are told with its next progress, bytes of that kind's own; from any thread.
  std::function<void(std::string)> tell;
};

/// How jobs of one kind are done.
struct JobKind {
  /// Does the work; throws to fail. Returns with outcome kCancelled, or throws Stopped, when the token fired.
  std::function<JobResult(const JobRun&)> work;
  /// What a job has published although its process died before that was recorded: the version; 0: nothing. Empty for
  /// kinds that publish nothing: their work, done again from its last checkpoint, ends with the same result.
  std::function<std::uint64_t(const JobRecord&)> published = {};
};

/// Runs the jobs of a registry, of whatever kind in the order of their creation, in threads of their own, beside the
/// workers that serve requests, each in an arena of bounded size. A job that a dead process left running is recorded as
/// what it was (published, cancelled) or goes on from its checkpoint; see docs/operations.md.
class JobRunner {
 public:
  using Kinds = std::map<std::string, JobKind>;
  /// Hears of every job that ends, from any thread; must be quick.
  using Ended = std::function<void(const JobRecord&)>;

  /// folder: <folder>/<key>/ is each job's own; what belongs to no job that goes on, and is no result that is kept, is
  /// removed. Settles what dead processes left, then begins. Throws FileError and what the registry throws.
  JobRunner(JobRegistry& registry, Kinds kinds, const JobLimits& limits, std::filesystem::path folder,
            Ended on_ended = {});
  /// As leave(), then waits.
  ~JobRunner();
  JobRunner(const JobRunner&) = delete;
  JobRunner& operator=(const JobRunner&) = delete;

  /// For what a client sends for a job that is to be started with it. Throws FileError.
  std::unique_ptr<JobInput> newInput() const;
  /// Creates a job of a known kind and queues it; see JobRegistry::create. input: becomes the job's unless an earlier
  /// one is returned. Throws what that throws, and FileError.
  JobRecord start(JobRecord wanted, JobInput* input = nullptr);
  /// Asks a job to stop: one that waits ends at once, one that runs soon. Throws NotFound.
  JobRecord cancel(const std::string& job);
  /// Forgets a job that has ended and its result. Throws as JobRegistry::remove.
  void forget(const std::string& job) const;
  /// The file of records (record_file.h) that a job has left. Throws NotFound; WrongState when it has not succeeded, or
  /// is of a kind without a result.
  std::filesystem::path resultOf(const std::string& job) const;
  /// What a job tells while it runs; null unless it runs here.
  std::shared_ptr<const JobNews> newsOf(const std::string& job) const;
  /// Whether jobs of this kind publish models; of an unknown kind yes, as nobody knows.
  bool publishes(const std::string& kind) const;
  /// Claims no more jobs and asks the running ones to keep a checkpoint and stop; they are queued again, for the next
  /// start. Does not wait.
  void leave();

 private:
  void settle(const JobRecord& left);
  void removeStrayFolders() const;
  void serve();
  std::optional<JobRecord> claimSoon();
  void run(const JobRecord& job);
  JobRun runOf(const JobRecord& job, std::stop_token stop);
  std::shared_ptr<JobNews> openNews(const std::string& id);
  std::optional<JobRecord> end(const std::string& id, const std::function<void(JobRecord&)>& change);
  std::stop_token enter(const std::string& id);
  bool pause(std::chrono::milliseconds time, std::uint64_t seen);
  void tidy(const JobRecord& job) const;
  void forgetOld() const;
  void forgetLargeResults() const;
  void told(const JobRecord& job) const;
  std::filesystem::path folderOf(const JobRecord& job) const { return folder_ / job.key; }

  JobRegistry& registry_;
  const Kinds kinds_;
  const JobLimits limits_;
  const std::filesystem::path folder_;
  const Ended on_ended_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::uint64_t wakes_ = 0;
  bool leaving_ = false;
  std::map<std::string, std::stop_source> stops_;         // of jobs that run
  std::map<std::string, std::shared_ptr<JobNews>> news_;  // of these, too
  std::vector<std::thread> threads_;
};

}  // namespace shaped::server
