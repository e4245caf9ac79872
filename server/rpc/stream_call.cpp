#include "server/rpc/stream_call.h"

#include <algorithm>

namespace shaped::server {

StreamCall::StreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context)
    : runtime_(runtime),
      pool_(pool),
      context_(context),
      call_(runtime, context, std::move(method), runtime.cap(pool)) {}

void StreamCall::enter() {
  self_ = shared_from_this();
  const Lock lock(mutex_);
  Caller caller;
  if (const auto proper = call_.guarded([&] { caller = call_.caller(); }); !proper.ok()) return end(proper);
  const auto decision = pool_.openStream(call_.id(), caller);
  decision.admitted ? begin() : end(call_.refusal(decision));
}

void StreamCall::queue(std::size_t bytes) {
  state_ = State::kWorking;
  call_.queued();
  pool_.proceed(call_.id(), bytes, [self = shared_from_this()] { self->work(); });
  // A stop just before found nothing to withdraw.
  if (call_.stopped() && pool_.withdraw(call_.id())) endStopped();
}

void StreamCall::stopAt(DeadlineTimer::Clock::time_point when, StopReason reason) {
  runtime_.timer.cancel(timer_);
  timer_ = runtime_.timer.schedule(when, [weak = weak_from_this(), reason] {
    if (const auto self = weak.lock()) self->onStop(reason);
  });
}

void StreamCall::awaitClient() {
  const auto patience = std::chrono::duration_cast<DeadlineTimer::Clock::duration>(runtime_.longest_call.load());
  stopAt(std::min(call_.deadline(), DeadlineTimer::Clock::now() + patience), StopReason::kDeadline);
}

void StreamCall::end(const grpc::Status& status) {
  state_ = State::kEnded;
  if (!call_.finishOnce(status)) return;
  pool_.leave(call_.id());  // before the answer, as PooledCall does
  finish(status);
}

void StreamCall::onStop(StopReason reason) {
  call_.stop(reason);
  const bool withdrawn = pool_.withdraw(call_.id());
  const Lock lock(mutex_);
  if (state_ == State::kEnded) return;
  if (withdrawn || state_ == State::kReading || state_ == State::kParked) return endStopped();
  // A write that waits for a client who does not read would wait for ever. A worker sees the stop by itself.
  if (state_ == State::kWriting) context_.TryCancel();
}

void StreamCall::forget() {
  runtime_.timer.cancel(timer_);
  const auto self = std::move(self_);
}

}  // namespace shaped::server
