#include "server/rpc/pooled_call.h"

namespace shaped::server {

PooledCall::PooledCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context)
    : runtime_(runtime),
      context_(context),
      call_(runtime, context, std::move(method), runtime.cap(pool)),
      pool_(pool) {}

void PooledCall::enter(std::size_t bytes) {
  self_ = shared_from_this();
  bytes_ = bytes;
  timer_ = runtime_.timer.schedule(call_.deadline(), [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->onStop(StopReason::kDeadline);
  });
  Caller caller;
  if (const auto proper = call_.guarded([&] { caller = call_.caller(); }); !proper.ok()) return end(proper);
  call_.queued();
  const auto decision = pool_.submit(call_.id(), caller, bytes_, [self = shared_from_this()] { self->work(); });
  if (!decision.admitted) return end(call_.refusal(decision));
  // A stop before submit() found nothing to withdraw.
  if (call_.stopped()) onStop(StopReason::kClient);
}

void PooledCall::work() {
  try {
    end(call_.guarded([this] { handle(); }));
  } catch (const Waiting& waiting) {
    park(waiting);
  }
}

void PooledCall::park(const Waiting& waiting) {
  parking_.enter();
  waiting.then([self = shared_from_this()] { self->resume(); });
  // A stop before enter() found nobody. Who takes the call out here is alone with it: it may have ended otherwise.
  if (call_.stopped() && parking_.leave()) end(call_.stopStatus());
}

void PooledCall::resume() {
  if (!parking_.leave()) return;
  call_.queued();
  pool_.proceed(call_.id(), bytes_, [self = shared_from_this()] { self->work(); });
  if (call_.stopped() && pool_.withdraw(call_.id())) end(call_.stopStatus());
}

void PooledCall::onStop(StopReason reason) {
  call_.stop(reason);
  if (parking_.leave() || pool_.withdraw(call_.id())) return end(call_.stopStatus());
  interrupt();
}

void PooledCall::end(const grpc::Status& status) {
  if (!call_.finishOnce(status)) return;
  // Before the answer: a client's next call must not find the place taken by this one.
  pool_.leave(call_.id());
  finish(status);
}

void PooledCall::forget() {
  runtime_.timer.cancel(timer_);
  const auto self = std::move(self_);
}

}  // namespace shaped::server
