#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/numerics/progress.h"
#include "server/jobs/job_record.h"

namespace shaped::server {

/// Which jobs to list, oldest first.
struct JobQuery {
  std::vector<JobState> states;  ///< empty: all
  std::string after;             ///< id of the last job of the page before; empty: from the first
  std::size_t limit = 100;       ///< at most so many, >= 1
};

/// Which ended jobs are kept.
struct JobRetention {
  std::size_t most = 1000;          ///< the latest ones, >= 1
  std::chrono::hours age{24 * 90};  ///< by the wall clock; 0: whatever their age
  /// Of the results that are kept, all together; the latest is kept whatever its size. Looked at by the runner, which
  /// knows the files.
  std::uintmax_t result_bytes = std::uintmax_t{10} << 30;
};

/// Where job records live: the one interface of job storage. A change is durable when the function returns, progress
/// aside. Safe from any thread.
///
/// Jobs are run by workers, and a job belongs to the worker that claimed it until it has ended or was put back. A claim
/// holds while its worker lives, however long the work takes and whatever the clocks do; no lock is held meanwhile. How
/// an implementation knows that a worker has died (a store's lock that is free again, a heartbeat missed) is its own.
///
/// Every function throws FileError when the storage fails, and StoreLocked when another program keeps it locked: then
/// nothing was changed.
class JobRegistry {
 public:
  /// Called after a change, on the thread that made it, without locks held; must be quick. Called no more, except where
  /// it already runs, once its owner has let go of it.
  using Listener = std::function<void()>;

  virtual ~JobRegistry() = default;

  /// Gives the record id, time and, where it has none, a key, and keeps it as queued. A job of the same request_id is
  /// returned instead if its request is the same. Throws AlreadyExists when that is another, Busy when `most_waiting`
  /// jobs are queued.
  virtual JobRecord create(JobRecord record, std::size_t most_waiting) = 0;
  /// Throws NotFound.
  virtual JobRecord get(const std::string& id) const = 0;
  /// The job of a client's request_id, if there is one.
  virtual std::optional<JobRecord> find(const std::string& request_id) const = 0;
  /// Throws InvalidInput naming "page_token" when query.after is no job's id.
  virtual std::vector<JobRecord> list(const JobQuery& query) const = 0;
  /// Listens while the returned pointer lives. Throws NotFound.
  virtual std::shared_ptr<const Listener> listen(const std::string& id, Listener listener) = 0;

  /// Changes a record in one step and tells the listeners. False, and nothing is changed, when it has ended. A state
  /// of kQueued puts a claimed job back. `change` must not call the registry. Throws NotFound.
  virtual bool update(const std::string& id, const std::function<void(JobRecord&)>& change) = 0;
  /// Where a claimed job stands: told to the listeners at once, made durable now and then. Never throws.
  virtual void report(const std::string& id, const Progress& progress) = 0;

  /// The oldest queued job, now running, its attempt counted; nothing when none waits.
  virtual std::optional<JobRecord> claim() = 0;
  /// Claims the jobs of workers that died, and counts their crash.
  virtual std::vector<JobRecord> takeOver() = 0;

  /// Forgets an ended job, and returns what was known of it. Throws NotFound, WrongState when it has not ended.
  virtual JobRecord remove(const std::string& id) = 0;
  /// Forgets ended jobs, the oldest first, as the retention says, and returns what was known of them.
  virtual std::vector<JobRecord> forgetOld(const JobRetention& retention) = 0;
};

}  // namespace shaped::server
