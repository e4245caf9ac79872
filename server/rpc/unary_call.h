#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>

#include "server/rpc/call.h"
#include "server/rpc/parking.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {

/// One request, one answer. gRPC's thread only queues; a worker runs the handler. A stop while the call still waits
/// ends it at once. Owns itself until gRPC is done with it.
template <class Request, class Response>
class UnaryCall final : public grpc::ServerUnaryReactor,
                        public std::enable_shared_from_this<UnaryCall<Request, Response>> {
 public:
  /// Fills the response or throws; see statusOf. Runs again from the start after it threw Waiting.
  using Handler = std::function<void(const Request&, Response&, Call&)>;

  UnaryCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
            const Request& request, Response& response, Handler handler)
      : runtime_(runtime),
        pool_(pool),
        call_(runtime, context, std::move(method),
              &pool == &runtime.heavy ? runtime.longest_heavy_call : runtime.longest_call.load()),
        request_(request),
        response_(response),
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
    // A stop before submit() found nothing to withdraw.
    if (call_.stopped()) onStop(StopReason::kClient);
  }

 private:
  void work() {
    try {
      end(call_.guarded([this] {
        requireWellFormed(request_);
        handler_(request_, response_, call_);
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

  void onStop(StopReason reason) {
    call_.stop(reason);
    if (parking_.leave() || pool_.withdraw(call_.id())) end(call_.stopStatus());
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
  Call call_;
  const Request& request_;
  Response& response_;
  Handler handler_;
  Parking parking_;
  DeadlineTimer::Id timer_;
  std::shared_ptr<UnaryCall> self_;
};

/// Runs a unary call on `pool`; the body of a service's method.
template <class Request, class Response>
grpc::ServerUnaryReactor* startUnary(Runtime& runtime, WorkerPool& pool, std::string method,
                                     grpc::CallbackServerContext* context, const Request* request, Response* response,
                                     typename UnaryCall<Request, Response>::Handler handler) {
  auto call = std::make_shared<UnaryCall<Request, Response>>(runtime, pool, std::move(method), *context, *request,
                                                             *response, std::move(handler));
  call->enter();
  return call.get();
}

}  // namespace shaped::server
