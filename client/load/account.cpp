#include "client/load/account.h"

#include <algorithm>

namespace shaped::client {
namespace {

constexpr std::chrono::milliseconds kLate{1};

}  // namespace

void LoadAccount::record(const CallOutcome& outcome) {
  if (outcome.intended < warm_up_) return;
  const auto delay = outcome.sent - outcome.intended;
  delay_.record(delay);
  if (delay > kLate) ++late_;
  last_end_ = std::max(last_end_, outcome.ended);
  sent_bytes_ += outcome.sent_bytes;
  received_bytes_ += outcome.received_bytes;
  if (outcome.code != grpc::OK) {
    ++failures_;
    ++errors_[{outcome.code, outcome.reason}];
    if (outcome.code == grpc::RESOURCE_EXHAUSTED) refusals_.record(outcome.ended - outcome.sent);
    return;
  }
  const auto latency = outcome.ended - outcome.intended;
  latency_.record(latency);
  service_.record(outcome.ended - outcome.sent);
  if (!deadline_ || latency <= *deadline_) ++good_;
}

void LoadAccount::recordUnsent(std::chrono::nanoseconds intended) {
  if (intended >= warm_up_) ++unsent_;
}

double LoadAccount::seconds() const {
  return std::chrono::duration<double>(std::max(warm_up_ + duration_, last_end_) - warm_up_).count();
}

}  // namespace shaped::client
