#pragma once

#include <atomic>
#include <stop_token>

namespace shaped::server {

enum class StopReason { kNone, kClient, kDeadline, kReader };

/// A stop source that remembers who pulled it first.
class Stopper {
 public:
  /// True for the first call only.
  bool stop(StopReason reason) {
    auto none = StopReason::kNone;
    const bool first = reason_.compare_exchange_strong(none, reason);
    source_.request_stop();
    return first;
  }
  std::stop_token token() const { return source_.get_token(); }
  bool stopped() const { return reason_ != StopReason::kNone; }
  StopReason reason() const { return reason_; }

 private:
  std::atomic<StopReason> reason_{StopReason::kNone};
  std::stop_source source_;
};

}  // namespace shaped::server
