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
  /// The client has sent all. A stream with one answer fills it here. In a stream of answers: true when `response` was
  /// filled and is to be sent, then comes again once it has been; so answers that must wait for the last message are
  /// made one at a time. Comes again after it threw Waiting, too.
  virtual bool end(Response& response, Call& call) = 0;
};

/// Many requests: each is read, queued for a worker, handled, perhaps answered; only then the next is read. Between
/// messages the stream holds no worker. The server's cap counts from the latest message: how long the client may be
/// silent, or leave an answer lying, and how long the work may take, its waiting for a worker included.
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
    awaitClient();
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

  void queueMessage() {
    stopAt(call().deadline(), StopReason::kDeadline);
    queue(has_message_ ? request_.ByteSizeLong() : 0);
  }

  void work() override {
    bool answer = false;
    own_response_.Clear();
    grpc::Status status;
    try {
      status = call().guarded([&] {
        if (has_message_) requireWellFormed(request_);
        answer = has_message_ ? handler_->message(request_, response(), call()) : handler_->end(response(), call());
      });
    } catch (const Waiting& waiting) {
      return park(waiting);
    }
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    const bool sends = answer && kAnswersMany;
    if (!status.ok() || (!has_message_ && !sends)) return end(status);
    if (call().stopped()) return endStopped();
    sends ? write() : read();
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
    awaitClient();
    if constexpr (kAnswersMany) this->StartWrite(&own_response_);
  }

  void onWritten(bool ok) {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok) call().stop(StopReason::kClient);
    if (call().stopped()) return endStopped();
    has_message_ ? read() : queueMessage();
  }

  Response& response() { return kAnswersMany ? own_response_ : *final_response_; }

  void finish(const grpc::Status& status) override { this->Finish(status); }
  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override { forget(); }

  static constexpr bool kAnswersMany = !std::is_base_of_v<grpc::ServerReadReactor<Request>, Reactor>;

  Response* final_response_;
  std::unique_ptr<Handler> handler_;
  bool has_message_ = false;  ///< else the client has sent all
  Request request_;
  Response own_response_;

 public:
  void OnWriteDone(bool ok) { onWritten(ok); }  // overrides in a bidi reactor only
};

/// A stream of answers: to every message, or all at the end.
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
