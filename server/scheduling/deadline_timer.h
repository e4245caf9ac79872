#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace shaped::server {

/// Runs callbacks at their time, on one thread of its own. Callbacks must be quick and must not throw.
class DeadlineTimer {
 public:
  using Clock = std::chrono::steady_clock;  // nobody sets it: no wait grows or ends when the time of day is corrected
  using Id = std::pair<Clock::time_point, std::uint64_t>;

  DeadlineTimer();
  /// Drops what has not come due.
  ~DeadlineTimer();
  DeadlineTimer(const DeadlineTimer&) = delete;
  DeadlineTimer& operator=(const DeadlineTimer&) = delete;

  Id schedule(Clock::time_point when, std::function<void()> callback);
  /// Forgets a callback. It may be running, or have run; the caller must not wait for it.
  void cancel(const Id& id);

 private:
  void serve();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<Id, std::function<void()>> pending_;
  std::uint64_t next_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace shaped::server
