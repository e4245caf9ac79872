#pragma once

#include <array>
#include <chrono>
#include <mutex>

namespace shaped::server {

/// How a call's time divides; what belongs to several messages of a stream adds up. Safe from any thread.
class CallTimes {
 public:
  enum class Phase {
    kResting,  ///< neither: between messages, or waiting for the client to take one
    kQueued,   ///< waiting for a worker
    kWorking,  ///< on a worker
  };

  /// Ends the phase that was.
  void enter(Phase next) {
    const std::scoped_lock lock(mutex_);
    const auto now = Clock::now();
    spent(phase_) += now - since_;
    phase_ = next;
    since_ = now;
  }
  /// In a phase until now [s].
  double seconds(Phase phase) {
    const std::scoped_lock lock(mutex_);
    const auto running = phase == phase_ ? Clock::now() - since_ : Clock::duration(0);
    return std::chrono::duration<double>(spent(phase) + running).count();
  }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::duration& spent(Phase phase) { return spent_[static_cast<std::size_t>(phase)]; }

  std::mutex mutex_;
  Phase phase_ = Phase::kResting;
  Clock::time_point since_ = Clock::now();
  std::array<Clock::duration, 3> spent_{};
};

}  // namespace shaped::server
