#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/scheduling/admission.h"

namespace shaped::server {

/// A fixed number of threads and a bounded queue, first come first served. Safe to use from any thread.
///
/// Work must not throw. What waits can be withdrawn by its id, which decides races: either withdraw() returns true and
/// the work never runs, or a worker has taken it.
class WorkerPool {
 public:
  /// Runs a worker's whole life, `serve`, inside whatever settings it makes for its thread. Empty: just serve.
  using Around = std::function<void(const std::function<void()>& serve)>;

  /// threads >= 1.
  WorkerPool(int threads, AdmissionLimits limits, const Around& around);
  /// Finishes what runs; drops what waits.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Queues the work, or refuses and says when to come back. id: unique among what waits. entry: a call or a
  /// continuation; streams enter by openStream().
  Decision submit(std::uint64_t id, std::size_t bytes, Entry entry, std::function<void()> work);
  /// Takes back what still waits; false when a worker has it, or it has ended.
  bool withdraw(std::uint64_t id);

  /// A place for a stream, to be given back by closeStream().
  Decision openStream();
  void closeStream();

  Load load() const;
  /// What is admitted from here on.
  void setLimits(const AdmissionLimits& limits);
  AdmissionLimits limits() const;

 private:
  struct Task {
    std::uint64_t id;
    std::size_t bytes;
    std::function<void()> work;
  };

  void serve();
  Load loadLocked() const;

  mutable std::mutex mutex_;
  AdmissionLimits limits_;
  std::condition_variable wake_;
  std::deque<Task> queue_;
  std::size_t queue_bytes_ = 0, busy_ = 0, open_streams_ = 0;
  double mean_seconds_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace shaped::server
