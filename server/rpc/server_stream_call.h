#pragma once

#include <grpcpp/support/server_callback.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>

#include "server/rpc/pooled_call.h"

namespace shaped::server {

/// One request, many answers. A worker runs the handler, which writes as it goes; write() waits until the message is on
/// its way, so that a slow reader slows the handler down instead of filling memory; one that takes nothing for
/// Runtime::write_patience is given up.
template <class Request, class Response>
class ServerStreamCall final : public grpc::ServerWriteReactor<Response>, public PooledCall {
 public:
  using Write = std::function<void(Response&&)>;
  /// Writes answers or throws; runs again from the start after it threw Waiting, before any answer. write throws
  /// Stopped when nobody listens any more.
  using Handler = std::function<void(const Request&, const Write& write, Call&)>;

  ServerStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                   const Request& request, Handler handler)
      : PooledCall(runtime, pool, std::move(method), context), request_(request), handler_(std::move(handler)) {}

 private:
  void handle() override {
    requireWellFormed(request_);
    handler_(
        request_, [this](Response&& message) { write(std::move(message)); }, call());
  }

  void write(Response&& message) {
    std::unique_lock lock(mutex_);
    call().throwIfStopped();
    message_ = std::move(message);
    writing_ = true;
    lock.unlock();
    this->StartWrite(&message_);
    lock.lock();
    call().waitForClient([&] {
      const auto taken = [this] { return !writing_; };
      if (written_.wait_for(lock, runtime_.write_patience, taken)) return;
      // A worker is worth more than a client who does not read.
      call().stop(StopReason::kReader);
      context_.TryCancel();
      written_.wait(lock, taken);
    });
    if (!arrived_) {
      call().stop(StopReason::kClient);
      call().throwIfStopped();
    }
  }

  void OnWriteDone(bool ok) override {
    const std::scoped_lock lock(mutex_);
    writing_ = false;
    arrived_ = ok;
    written_.notify_one();
  }

  /// A write that waits for a client who does not read would wait for ever.
  void interrupt() override {
    const std::scoped_lock lock(mutex_);
    if (writing_) context_.TryCancel();
  }

  void finish(const grpc::Status& status) override { this->Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  const Request& request_;
  Handler handler_;
  std::mutex mutex_;
  std::condition_variable written_;
  Response message_;
  bool writing_ = false, arrived_ = true;
};

/// Runs a server-streaming call on `pool`; the body of a service's method.
template <class Request, class Response>
grpc::ServerWriteReactor<Response>* startServerStream(Runtime& runtime, WorkerPool& pool, std::string method,
                                                      grpc::CallbackServerContext* context, const Request* request,
                                                      typename ServerStreamCall<Request, Response>::Handler handler) {
  auto call = std::make_shared<ServerStreamCall<Request, Response>>(runtime, pool, std::move(method), *context,
                                                                    *request, std::move(handler));
  call->enter(request->ByteSizeLong());
  return call.get();
}

}  // namespace shaped::server
