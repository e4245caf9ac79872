#pragma once

#include <grpcpp/support/server_callback.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>

#include "server/rpc/call.h"
#include "server/rpc/parking.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {

/// One request, many answers. A worker runs the handler, which writes as it goes; write() waits until the message is on
/// its way, so that a slow reader slows the handler down instead of filling memory; one that takes nothing for
/// Runtime::write_patience is given up.
template <class Request, class Response>
class ServerStreamCall final : public grpc::ServerWriteReactor<Response>,
                               public std::enable_shared_from_this<ServerStreamCall<Request, Response>> {
 public:
  using Write = std::function<void(Response&&)>;
  /// Writes answers or throws; runs again from the start after it threw Waiting, before any answer. write throws
  /// Stopped when nobody listens any more.
  using Handler = std::function<void(const Request&, const Write& write, Call&)>;

  ServerStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                   const Request& request, Handler handler)
      : runtime_(runtime),
        pool_(pool),
        context_(context),
        call_(runtime, context, std::move(method), runtime.longest_call),
        request_(request),
        handler_(std::move(handler)) {}

  void enter() {
    self_ = this->shared_from_this();
    timer_ = runtime_.timer.schedule(call_.deadline(), [weak = this->weak_from_this()] {
      if (const auto self = weak.lock()) self->onStop(StopReason::kDeadline);
    });
    call_.queued();
    const auto decision = pool_.submit(call_.id(), request_.ByteSizeLong(), Entry::kCall,
                                       [self = this->shared_from_this()] { self->work(); });
    if (!decision.admitted) end(call_.refusal(decision));
    if (call_.stopped()) onStop(StopReason::kClient);
  }

 private:
  void work() {
    try {
      end(call_.guarded([this] {
        requireWellFormed(request_);
        handler_(
            request_, [this](Response&& message) { write(std::move(message)); }, call_);
      }));
    } catch (const Waiting& waiting) {
      park(waiting);
    }
  }

  void park(const Waiting& waiting) {
    parking_.enter();
    waiting.then([self = this->shared_from_this()] { self->resume(); });
    // A stop before enter() found nobody. Who takes the call out here is alone with it: it may have ended otherwise.
    if (call_.stopped() && parking_.leave()) end(call_.stopStatus());
  }

  void resume() {
    if (!parking_.leave()) return;
    call_.queued();
    pool_.submit(call_.id(), 0, Entry::kContinuation, [self = this->shared_from_this()] { self->work(); });
    if (call_.stopped() && pool_.withdraw(call_.id())) end(call_.stopStatus());
  }

  void write(Response&& message) {
    std::unique_lock lock(mutex_);
    call_.throwIfStopped();
    message_ = std::move(message);
    writing_ = true;
    lock.unlock();
    this->StartWrite(&message_);
    lock.lock();
    call_.waitForClient([&] {
      const auto taken = [this] { return !writing_; };
      if (written_.wait_for(lock, runtime_.write_patience, taken)) return;
      // A worker is worth more than a client who does not read.
      call_.stop(StopReason::kReader);
      context_.TryCancel();
      written_.wait(lock, taken);
    });
    if (!arrived_) {
      call_.stop(StopReason::kClient);
      call_.throwIfStopped();
    }
  }

  void OnWriteDone(bool ok) override {
    const std::scoped_lock lock(mutex_);
    writing_ = false;
    arrived_ = ok;
    written_.notify_one();
  }

  void onStop(StopReason reason) {
    call_.stop(reason);
    if (parking_.leave() || pool_.withdraw(call_.id())) return end(call_.stopStatus());
    // A write that waits for a client who does not read would wait for ever.
    const std::scoped_lock lock(mutex_);
    if (writing_) context_.TryCancel();
  }

  void end(const grpc::Status& status) {
    if (call_.finishOnce(status)) this->Finish(status);
  }

  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override {
    runtime_.timer.cancel(timer_);
    const auto self = std::move(self_);
  }

  Runtime& runtime_;
  WorkerPool& pool_;
  grpc::CallbackServerContext& context_;
  Call call_;
  const Request& request_;
  Handler handler_;
  Parking parking_;
  DeadlineTimer::Id timer_;
  std::mutex mutex_;
  std::condition_variable written_;
  Response message_;
  bool writing_ = false, arrived_ = true;
  std::shared_ptr<ServerStreamCall> self_;
};

/// Runs a server-streaming call on `pool`; the body of a service's method.
template <class Request, class Response>
grpc::ServerWriteReactor<Response>* startServerStream(Runtime& runtime, WorkerPool& pool, std::string method,
                                                      grpc::CallbackServerContext* context, const Request* request,
                                                      typename ServerStreamCall<Request, Response>::Handler handler) {
  auto call = std::make_shared<ServerStreamCall<Request, Response>>(runtime, pool, std::move(method), *context,
                                                                    *request, std::move(handler));
  call->enter();
  return call.get();
}

}  // namespace shaped::server
