#include "server/rpc/wait_call.h"

#include <algorithm>

#include "core/numerics/error.h"
#include "server/convert/job.h"

namespace shaped::server {

grpc::Status daemonStops(const std::string& job) {
  return {grpc::UNAVAILABLE, "the daemon is stopping; job " + job + " goes on when it is started again"};
}

WaitCall::WaitCall(Runtime& runtime, JobRegistry& registry, grpc::CallbackServerContext& context,
                   const v1::WaitJobRequest& request, v1::WaitJobResponse& response, std::stop_token stop)
    : runtime_(runtime),
      registry_(registry),
      call_(runtime, context, "Jobs.Wait", runtime.longest_call),
      job_(request.id()),
      timeout_(request.has_timeout() ? std::optional(request.timeout()) : std::nullopt),
      response_(response),
      stop_(std::move(stop)) {}

void WaitCall::enter(const v1::WaitJobRequest& request) {
  self_ = shared_from_this();
  const auto self = [weak = weak_from_this()] { return weak.lock(); };
  const auto status = call_.guarded([&] {
    requireWellFormed(request);
    if (timeout_ && (timeout_->seconds() < 0 || timeout_->nanos() < 0))
      throw InvalidInput("timeout", "is negative, want >= 0");
    listener_ = registry_.listen(job_, [self] {
      if (const auto call = self()) call->look(Cause::kChange);
    });
  });
  if (!status.ok()) return end(status);
  timer_ = runtime_.timer.schedule(until(), [self] {
    if (const auto call = self()) call->look(Cause::kTimeUp);
  });
  on_daemon_stops_.emplace(stop_, [self] {
    if (const auto call = self()) call->end(daemonStops(call->job_));
  });
  look(Cause::kChange);
}

DeadlineTimer::Clock::time_point WaitCall::until() const {
  // A little before the call's own deadline, so that there is an answer.
  const auto last = call_.deadline() - std::chrono::milliseconds(100);
  if (!timeout_) return last;
  constexpr std::int64_t kMostSeconds = 1'000'000'000;  // no overflow of the clock
  const auto wanted =
      std::chrono::seconds(std::min(timeout_->seconds(), kMostSeconds)) + std::chrono::nanoseconds(timeout_->nanos());
  return std::min(last, DeadlineTimer::Clock::now() + wanted);
}

/// From any thread: only one ends the call, and only that one fills the response.
void WaitCall::look(Cause cause) {
  std::optional<JobRecord> record;
  try {
    record = registry_.get(job_);
  } catch (...) {
    return end(statusOf(std::current_exception(), StopReason::kNone));
  }
  if (!hasEnded(record->state) && cause == Cause::kChange) return;
  if (!call_.finishOnce(grpc::Status::OK)) return;
  toProto(*record, *response_.mutable_job());
  Finish(grpc::Status::OK);
}

void WaitCall::end(const grpc::Status& status) {
  if (call_.finishOnce(status)) Finish(status);
}

void WaitCall::OnCancel() {
  call_.stop(StopReason::kClient);
  end(call_.stopStatus());
}

void WaitCall::OnDone() {
  listener_.reset();
  on_daemon_stops_.reset();
  runtime_.timer.cancel(timer_);
  const auto self = std::move(self_);
}

}  // namespace shaped::server
