#pragma once

#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "server/rpc/stream_call.h"

namespace shaped::server {

/// One request, many answers that cost little to make: each is made on a worker and sent; only when the client has
/// taken it is the next one made. While it waits for the client the stream holds no worker, so that any number of slow
/// clients keep nobody from the pool; one that takes nothing for Runtime::write_patience is given up. The server's cap
/// counts from the latest message.
template <class Request, class Response>
class OutgoingStreamCall final : public grpc::ServerWriteReactor<Response>, public StreamCall {
 public:
  /// Fills the next message; false when there is none left. One at a time, on any worker. Throws as statusOf says.
  using Next = std::function<bool(Response&, Call&)>;
  /// Makes the messages of a request; called once, on a worker.
  using Begin = std::function<Next(const Request&, Call&)>;

  OutgoingStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                     const Request& request, Begin begin)
      : StreamCall(runtime, pool, std::move(method), context), request_(request), begin_(std::move(begin)) {}

 private:
  void begin() override { make(); }

  void make() {
    stopAt(call().deadline(), StopReason::kDeadline);
    queue(0);
  }

  void work() override {
    bool more = false;
    message_.Clear();
    const auto status = call().guarded([&] {
      if (!next_) {
        requireWellFormed(request_);
        next_ = begin_(request_, call());
      }
      more = next_(message_, call());
    });
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!status.ok() || !more) return end(status);
    if (call().stopped()) return endStopped();
    write();
  }

  void write() {
    state_ = State::kWriting;
    const auto patience = std::chrono::duration_cast<DeadlineTimer::Clock::duration>(runtime().write_patience);
    const auto given_up = DeadlineTimer::Clock::now() + patience;
    const auto deadline = call().deadline();
    stopAt(std::min(given_up, deadline), deadline < given_up ? StopReason::kDeadline : StopReason::kReader);
    this->StartWrite(&message_);
  }

  void OnWriteDone(bool ok) override {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok) call().stop(StopReason::kClient);
    call().stopped() ? endStopped() : make();
  }

  void finish(const grpc::Status& status) override { this->Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  const Request& request_;
  Begin begin_;
  Next next_;
  Response message_;
};

/// Runs a stream of answers on `pool`; the body of a service's method.
template <class Request, class Response>
grpc::ServerWriteReactor<Response>* startOutgoing(Runtime& runtime, WorkerPool& pool, std::string method,
                                                  grpc::CallbackServerContext* context, const Request* request,
                                                  typename OutgoingStreamCall<Request, Response>::Begin begin) {
  auto call = std::make_shared<OutgoingStreamCall<Request, Response>>(runtime, pool, std::move(method), *context,
                                                                      *request, std::move(begin));
  call->enter();
  return call.get();
}

}  // namespace shaped::server
