#pragma once

#include <map>
#include <mutex>

#include "server/jobs/job_registry.h"
#include "server/jobs/job_table.h"

namespace shaped::server {

/// Job records in one SQLite file, for one daemon at a time: whoever opens it holds the lock of its store, so workers
/// of any other process are dead. Jobs that have not ended are kept in memory too, where their progress is livelier
/// than in the file.
class SqliteJobRegistry final : public JobRegistry {
 public:
  using Duration = std::chrono::steady_clock::duration;

  /// file: made when missing; ":memory:" for records that end with the process. save_every: progress that is this old
  /// is written at the next report. Throws as JobTable's constructor and as every function here.
  explicit SqliteJobRegistry(const std::filesystem::path& file, Duration save_every = std::chrono::seconds(5));

  JobRecord create(JobRecord record, std::size_t most_waiting) override;
  JobRecord get(const std::string& id) const override;
  std::optional<JobRecord> find(const std::string& request_id) const override;
  std::vector<JobRecord> list(const JobQuery& query) const override;
  std::shared_ptr<const Listener> listen(const std::string& id, Listener listener) override;
  bool update(const std::string& id, const std::function<void(JobRecord&)>& change) override;
  void report(const std::string& id, const Progress& progress) override;
  std::optional<JobRecord> claim() override;
  std::vector<JobRecord> takeOver() override;
  JobRecord remove(const std::string& id) override;
  std::vector<JobRecord> forgetOld(const JobRetention& retention) override;

 private:
  using Steady = std::chrono::steady_clock;
  using Row = JobTable::Row;

  /// A job that has not ended.
  struct Live {
    Row row;
    Steady::time_point saved;
    std::vector<std::weak_ptr<const Listener>> listeners;
  };
  /// By number, so that they are in order of creation.
  using LiveJobs = std::map<std::uint64_t, Live>;
  using Listeners = std::vector<std::shared_ptr<const Listener>>;

  // All below with the mutex held.
  LiveJobs::iterator findLive(const std::string& id);
  LiveJobs::const_iterator findLive(const std::string& id) const;
  JobRecord liveOr(const Row& row) const;
  void save(Live& live, Row row);
  Listeners listenersOf(Live& live);

  static void tell(const Listeners& listeners);

  const Duration save_every_;
  const std::string owner_;
  mutable std::mutex mutex_;
  mutable JobTable table_;
  LiveJobs live_;
};

}  // namespace shaped::server
