#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/scheduling/request_queue.h"

namespace shaped::server {

/// Threads that work off a bounded queue, in the order of order.h. Safe to use from any thread.
///
/// A thread is started when work waits and none is free, up to the pool's number, and then stays: each takes a tenth of
/// a megabyte (stack, and what libraries keep for every thread), which a daemon that has nothing to do need not hold.
/// A thread inherits how nice it is from the one that starts it: who gives way to others starts none but the first.
///
/// Work must not throw. What waits can be withdrawn by its id, which decides races: either withdraw() returns true and
/// the work never runs, or a worker has taken it. Whoever was admitted holds a place until leave().
class WorkerPool {
 public:
  /// Runs a worker's whole life, `serve`, inside whatever settings it makes for its thread. Empty: just serve.
  using Around = std::function<void(const std::function<void()>& serve)>;
  using Work = RequestQueue::Work;

  /// name: of its threads, for top and debuggers, at most 15 characters. threads: the most there may be, >= 1.
  WorkerPool(std::string name, int threads, AdmissionLimits limits, Around around);
  /// Finishes what runs; drops what waits.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Starts the first thread now: for a pool that a thread which gives way to others (nice) may be the first to submit
  /// to. Throws std::system_error where the system gives none.
  void hireFirst();

  /// A call: takes a place and queues the work, or says when to come back. id: unique among those who hold places.
  /// Refuses for want of memory where not even one thread can be started, as openStream() does.
  Decision submit(std::uint64_t id, const Caller& caller, std::size_t bytes, Work work);
  /// A stream: takes a place, or says when to come back.
  Decision openStream(std::uint64_t id, const Caller& caller);
  /// The next piece of work of somebody who has a place and nothing queued: a stream's message, a call that goes on.
  /// bytes: of its message.
  void proceed(std::uint64_t id, std::size_t bytes, Work work);
  /// Takes back what still waits; false when a worker has it, or it has ended. The place stays.
  bool withdraw(std::uint64_t id);
  /// Gives the place back; nothing where there is none.
  void leave(std::uint64_t id);

  Load load() const;
  /// What is admitted from here on.
  void setLimits(const AdmissionLimits& limits);
  AdmissionLimits limits() const;
  /// How long to wait for the next class [s], > 0; see next().
  void setAgeing(double seconds);

 private:
  // Call these with the mutex held.
  bool hire();
  bool staffed() { return !threads_.empty() || hire(); }
  void hireWhereWorkWaits();

  void serve();

  const std::string name_;
  const Around around_;
  const int nice_;  ///< of the thread that made the pool
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  RequestQueue queue_;
  std::size_t idle_ = 0;  ///< threads that wait for work, are about to, or have been woken for it
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace shaped::server
