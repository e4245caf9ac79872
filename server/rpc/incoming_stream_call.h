#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <type_traits>

#include "server/rpc/stream_call.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {

/// What the messages of one stream are given to, in order, one at a time, on any worker. Throws as statusOf says.
template <class Request, class Response>
class StreamHandler {
 public:
  virtual ~StreamHandler() = default;
  /// A message; comes again after it threw Waiting. True when `response` was filled and is to be sent (streams that
  /// answer every message).
  virtual bool message(const Request& request, Response& response, Call& call) = 0;
  /// The client has sent all; fills the one response of a stream that answers at the end. Comes again after it threw
  /// Waiting.
  virtual void end(Response& response, Call& call) = 0;
};

/// Many requests: each is read, queued for a worker, handled, perhaps answered; only then the next is read. Between
/// messages the stream holds no worker. The server's cap counts from the latest message.
/// Reactor: ServerBidiReactor<Request, Response>, or ServerReadReactor<Request> where `final_response` is the one
/// answer.
template <class Reactor, class Request, class Response>
class IncomingStreamCall final : public Reactor, public StreamCall {
 public:
  using Handler = StreamHandler<Request, Response>;

  IncomingStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                     Response* final_response, std::unique_ptr<Handler> handler)
      : StreamCall(runtime, pool, std::move(method), context),
        final_response_(final_response),
        handler_(std::move(handler)) {}

 private:
  void begin() override { read(); }

  void read() {
    state_ = State::kReading;
    stopAt(call().deadline(), StopReason::kDeadline);
    this->StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok && cancelled()) call().stop(StopReason::kClient);
    if (call().stopped()) return endStopped();
    has_message_ = ok;
    queueMessage();
  }

  void queueMessage() { queue(has_message_ ? request_.ByteSizeLong() : 0); }

  void work() override {
    bool answer = false;
    own_response_.Clear();
    grpc::Status status;
    try {
      status = call().guarded([&] {
        if (!has_message_) return handler_->end(response(), call());
        requireWellFormed(request_);
        answer = handler_->message(request_, response(), call());
      });
    } catch (const Waiting& waiting) {
      return park(waiting);
    }
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!status.ok() || !has_message_) return end(status);
    if (call().stopped()) return endStopped();
    answer ? write() : read();
  }

  /// The message, or the end, is handled again once what it waits for has come.
  void park(const Waiting& waiting) {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (call().stopped()) return endStopped();
    state_ = State::kParked;
    waiting.then([self = std::static_pointer_cast<IncomingStreamCall>(shared_from_this())] { self->resume(); });
  }

  void resume() {
    const Lock lock(mutex_);
    if (state_ == State::kParked) queueMessage();
  }

  void write() {
    state_ = State::kWriting;
    if constexpr (kAnswersEach) this->StartWrite(&own_response_);
  }

  void onWritten(bool ok) {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok) call().stop(StopReason::kClient);
    call().stopped() ? endStopped() : read();
  }

  Response& response() { return kAnswersEach ? own_response_ : *final_response_; }

  void finish(const grpc::Status& status) override { this->Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  static constexpr bool kAnswersEach = !std::is_base_of_v<grpc::ServerReadReactor<Request>, Reactor>;

  Response* final_response_;
  std::unique_ptr<Handler> handler_;
  bool has_message_ = false;  ///< else the client has sent all
  Request request_;
  Response own_response_;

 public:
  void OnWriteDone(bool ok) { onWritten(ok); }  // overrides in a bidi reactor only
};

/// A stream that answers every message.
template <class Request, class Response>
grpc::ServerBidiReactor<Request, Response>* startBidi(Runtime& runtime, WorkerPool& pool, std::string method,
                                                      grpc::CallbackServerContext* context,
                                                      std::unique_ptr<StreamHandler<Request, Response>> handler) {
  using Reactor = grpc::ServerBidiReactor<Request, Response>;
  auto call = std::make_shared<IncomingStreamCall<Reactor, Request, Response>>(runtime, pool, std::move(method),
                                                                               *context, nullptr, std::move(handler));
  call->enter();
  return call.get();
}

/// A stream that is answered once, at its end.
template <class Request, class Response>
grpc::ServerReadReactor<Request>* startClientStream(Runtime& runtime, WorkerPool& pool, std::string method,
                                                    grpc::CallbackServerContext* context, Response* response,
                                                    std::unique_ptr<StreamHandler<Request, Response>> handler) {
  using Reactor = grpc::ServerReadReactor<Request>;
  auto call = std::make_shared<IncomingStreamCall<Reactor, Request, Response>>(runtime, pool, std::move(method),
                                                                               *context, response, std::move(handler));
  call->enter();
  return call.get();
}

}  // namespace shaped::server
