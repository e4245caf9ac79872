#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/jobs/job_record.h"

namespace shaped::server {

/// Where job records live. Safe from any thread.
class JobRegistry {
 public:
  /// Called after a change, on the thread that made it, without locks held; must be quick. Called no more, except where
  /// it already runs, once its owner has let go of it.
  using Listener = std::function<void()>;

  virtual ~JobRegistry() = default;
  /// Gives the record its id and keeps it.
  virtual JobRecord create(JobRecord record) = 0;
  /// Throws NotFound.
  virtual JobRecord get(const std::string& id) const = 0;
  /// Oldest first.
  virtual std::vector<JobRecord> list() const = 0;
  /// Changes a record in one step and tells the listeners. A record that has ended is not changed any more: false.
  virtual bool update(const std::string& id, const std::function<void(JobRecord&)>& change) = 0;
  /// Listens while the returned pointer lives. Throws NotFound.
  virtual std::shared_ptr<const Listener> listen(const std::string& id, Listener listener) = 0;
};

/// Records in memory: they end with the process. Keeps the latest `most_ended` jobs that have ended.
class MemoryJobRegistry final : public JobRegistry {
 public:
  explicit MemoryJobRegistry(std::size_t most_ended = 1000) : most_ended_(most_ended) {}

  JobRecord create(JobRecord record) override;
  JobRecord get(const std::string& id) const override;
  std::vector<JobRecord> list() const override;
  bool update(const std::string& id, const std::function<void(JobRecord&)>& change) override;
  std::shared_ptr<const Listener> listen(const std::string& id, Listener listener) override;

 private:
  struct Entry {
    JobRecord record;
    std::vector<std::weak_ptr<const Listener>> listeners;
  };

  Entry& find(const std::string& id);
  void forgetOld();

  const std::size_t most_ended_;
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Entry> entries_;  // by number, which is also the id
  std::uint64_t next_ = 1;
};

}  // namespace shaped::server
