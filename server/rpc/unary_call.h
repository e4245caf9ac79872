#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>

#include "server/rpc/pooled_call.h"

namespace shaped::server {

/// One request, one answer.
template <class Request, class Response>
class UnaryCall final : public grpc::ServerUnaryReactor, public PooledCall {
 public:
  /// Fills the response or throws; see statusOf. Runs again from the start after it threw Waiting.
  using Handler = std::function<void(const Request&, Response&, Call&)>;

  UnaryCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
            const Request& request, Response& response, Handler handler)
      : PooledCall(runtime, pool, std::move(method), context),
        request_(request),
        response_(response),
        handler_(std::move(handler)) {}

 private:
  void handle() override {
    requireWellFormed(request_);
    handler_(request_, response_, call());
  }
  void finish(const grpc::Status& status) override { Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  const Request& request_;
  Response& response_;
  Handler handler_;
};

/// Runs a unary call on `pool`; the body of a service's method.
template <class Request, class Response>
grpc::ServerUnaryReactor* startUnary(Runtime& runtime, WorkerPool& pool, std::string method,
                                     grpc::CallbackServerContext* context, const Request* request, Response* response,
                                     typename UnaryCall<Request, Response>::Handler handler) {
  auto call = std::make_shared<UnaryCall<Request, Response>>(runtime, pool, std::move(method), *context, *request,
                                                             *response, std::move(handler));
  call->enter(request->ByteSizeLong());
  return call.get();
}

}  // namespace shaped::server
