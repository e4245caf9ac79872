#pragma once

#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>

#include "server/rpc/pooled_call.h"

namespace shaped::server {

/// One request, many answers. A worker runs the handler, which writes as it goes; one message is on its way at a time
/// while the next is made, so that a slow reader slows the handler down instead of filling memory; one that takes
/// nothing for Runtime::write_patience is given up.
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
    const auto writer = [this](Response&& message) { write(std::move(message)); };
    std::exception_ptr failure;
    try {
      handler_(request_, writer, call());
    } catch (...) {
      failure = std::current_exception();
    }
    // The status goes after the last answer.
    std::unique_lock lock(mutex_);
    waitUntilTaken(lock);
    if (failure) std::rethrow_exception(failure);
    requireArrived();
  }

  /// While this answer is on its way, the handler makes the next one.
  void write(Response&& message) {
    std::unique_lock lock(mutex_);
    call().throwIfStopped();
    waitUntilTaken(lock);
    requireArrived();
    message_ = std::move(message);
    writing_ = true;
    lock.unlock();
    this->StartWrite(&message_);
  }

  void waitUntilTaken(std::unique_lock<std::mutex>& lock) {
    if (!writing_) return;
    constexpr std::chrono::milliseconds grace(100);  // for what is nearly through, so that the client learns the cause
    const auto taken = [this] { return !writing_; };
    call().waitForClient([&] {
      const bool in_time =
          changed_.wait_for(lock, runtime_.write_patience, [this] { return !writing_ || call().stopped(); });
      if (!writing_ || (in_time && changed_.wait_for(lock, grace, taken))) return;
      // A worker is worth more than a client who does not read.
      if (!in_time) call().stop(StopReason::kReader);
      context_.TryCancel();
      changed_.wait(lock, taken);
    });
  }

  void requireArrived() {
    if (arrived_) return;
    call().stop(StopReason::kClient);
    call().throwIfStopped();
  }

  void OnWriteDone(bool ok) override {
    const std::scoped_lock lock(mutex_);
    writing_ = false;
    arrived_ = ok;
    changed_.notify_one();
  }

  void interrupt() override {
    const std::scoped_lock lock(mutex_);
    changed_.notify_one();
  }

  void finish(const grpc::Status& status) override { this->Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  const Request& request_;
  Handler handler_;
  std::mutex mutex_;
  std::condition_variable changed_;  // a message was taken, or the call stopped
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
