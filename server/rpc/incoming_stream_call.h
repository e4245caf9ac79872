#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>
#include <type_traits>

#include "server/rpc/call.h"
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
class IncomingStreamCall final : public Reactor,
                                 public std::enable_shared_from_this<IncomingStreamCall<Reactor, Request, Response>> {
 public:
  using Handler = StreamHandler<Request, Response>;

  IncomingStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                     Response* final_response, std::unique_ptr<Handler> handler)
      : runtime_(runtime),
        pool_(pool),
        context_(context),
        call_(runtime, context, std::move(method), runtime.longest_call),
        final_response_(final_response),
        handler_(std::move(handler)) {}

  void enter() {
    self_ = this->shared_from_this();
    const Lock lock(mutex_);
    Caller caller;
    if (const auto proper = call_.guarded([&] { caller = call_.caller(); }); !proper.ok()) return end(proper);
    const auto decision = pool_.openStream(call_.id(), caller);
    decision.admitted ? read() : end(call_.refusal(decision));
  }

 private:
  enum class State { kReading, kWorking, kParked, kWriting, kEnded };
  // Every function below holds mutex_. It is recursive because gRPC may run a reaction inside the call that causes it.
  using Lock = std::scoped_lock<std::recursive_mutex>;

  void read() {
    state_ = State::kReading;
    runtime_.timer.cancel(timer_);
    timer_ = runtime_.timer.schedule(call_.deadline(), [weak = this->weak_from_this()] {
      if (const auto self = weak.lock()) self->onStop(StopReason::kDeadline);
    });
    this->StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok && context_.IsCancelled()) call_.stop(StopReason::kClient);
    if (call_.stopped()) return end(call_.stopStatus());
    state_ = State::kWorking;
    call_.queued();
    pool_.proceed(call_.id(), messageBytes(ok), [self = this->shared_from_this(), ok] { self->work(ok); });
  }

  /// On a worker, without the lock: the state keeps everyone else away from request and response.
  void work(bool has_message) {
    bool answer = false;
    own_response_.Clear();
    grpc::Status status;
    try {
      status = call_.guarded([&] {
        if (!has_message) return handler_->end(response(), call_);
        requireWellFormed(request_);
        answer = handler_->message(request_, response(), call_);
      });
    } catch (const Waiting& waiting) {
      return park(waiting, has_message);
    }
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!status.ok() || !has_message) return end(status);
    if (call_.stopped()) return end(call_.stopStatus());
    answer ? write() : read();
  }

  /// The message, or the end, is handled again once what it waits for has come.
  void park(const Waiting& waiting, bool has_message) {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (call_.stopped()) return end(call_.stopStatus());
    state_ = State::kParked;
    waiting.then([self = this->shared_from_this(), has_message] { self->resume(has_message); });
  }

  void resume(bool has_message) {
    const Lock lock(mutex_);
    if (state_ != State::kParked) return;
    state_ = State::kWorking;
    call_.queued();
    pool_.proceed(call_.id(), messageBytes(has_message),
                  [self = this->shared_from_this(), has_message] { self->work(has_message); });
  }

  void write() {
    state_ = State::kWriting;
    if constexpr (kAnswersEach) this->StartWrite(&own_response_);
  }

  void onWritten(bool ok) {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok) call_.stop(StopReason::kClient);
    call_.stopped() ? end(call_.stopStatus()) : read();
  }

  void onStop(StopReason reason) {
    call_.stop(reason);
    const bool withdrawn = pool_.withdraw(call_.id());
    const Lock lock(mutex_);
    if (withdrawn || state_ == State::kReading || state_ == State::kParked) return end(call_.stopStatus());
    // A write that waits for a client who does not read would wait for ever. A worker sees the stop by itself.
    if (state_ == State::kWriting) context_.TryCancel();
  }

  void end(const grpc::Status& status) {
    state_ = State::kEnded;
    if (!call_.finishOnce(status)) return;
    pool_.leave(call_.id());  // before the answer, as PooledCall does
    this->Finish(status);
  }

  std::size_t messageBytes(bool has_message) const { return has_message ? request_.ByteSizeLong() : 0; }

  Response& response() { return kAnswersEach ? own_response_ : *final_response_; }

  void OnCancel() override { onStop(StopReason::kClient); }
  void OnDone() override {
    runtime_.timer.cancel(timer_);
    const auto self = std::move(self_);
  }

  static constexpr bool kAnswersEach = !std::is_base_of_v<grpc::ServerReadReactor<Request>, Reactor>;

  Runtime& runtime_;
  WorkerPool& pool_;
  grpc::CallbackServerContext& context_;
  Call call_;
  Response* final_response_;
  std::unique_ptr<Handler> handler_;
  std::recursive_mutex mutex_;
  State state_ = State::kReading;
  DeadlineTimer::Id timer_;
  Request request_;
  Response own_response_;
  std::shared_ptr<IncomingStreamCall> self_;

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
