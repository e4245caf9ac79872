#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>

#include "server/rpc/call.h"

namespace shaped::server {

/// One request, many answers that cost little to make: each is made on a worker and sent; only when the client has
/// taken it is the next one made. While it waits for the client the stream holds no worker, so that any number of slow
/// clients keep nobody from the pool; one that takes nothing for Runtime::write_patience is given up. The server's cap
/// counts from the latest message.
template <class Request, class Response>
class OutgoingStreamCall final : public grpc::ServerWriteReactor<Response>,
                                 public std::enable_shared_from_this<OutgoingStreamCall<Request, Response>> {
 public:
  /// Fills the next message; false when there is none left. One at a time, on any worker. Throws as statusOf says.
  using Next = std::function<bool(Response&, Call&)>;
  /// Makes the messages of a request; called once, on a worker.
  using Begin = std::function<Next(const Request&, Call&)>;

  OutgoingStreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context,
                     const Request& request, Begin begin)
      : runtime_(runtime),
        pool_(pool),
        context_(context),
        call_(runtime, context, std::move(method), runtime.longest_call),
        request_(request),
        begin_(std::move(begin)) {}

  void enter() {
    self_ = this->shared_from_this();
    const Lock lock(mutex_);
    Caller caller;
    if (const auto proper = call_.guarded([&] { caller = call_.caller(); }); !proper.ok()) return end(proper);
    const auto decision = pool_.openStream(call_.id(), caller);
    if (!decision.admitted) return end(call_.refusal(decision));
    queue();
    if (call_.stopped() && pool_.withdraw(call_.id())) end(call_.stopStatus());
  }

 private:
  enum class State { kWorking, kWriting, kEnded };
  // Every function below but work() holds mutex_. It is recursive because gRPC may run a reaction inside the call that
  // causes it.
  using Lock = std::scoped_lock<std::recursive_mutex>;

  void stopAt(DeadlineTimer::Clock::time_point when, StopReason reason) {
    runtime_.timer.cancel(timer_);
    timer_ = runtime_.timer.schedule(when, [weak = this->weak_from_this(), reason] {
      if (const auto self = weak.lock()) self->onStop(reason);
    });
  }

  void queue() {
    state_ = State::kWorking;
    stopAt(call_.deadline(), StopReason::kDeadline);
    call_.queued();
    pool_.proceed(call_.id(), 0, [self = this->shared_from_this()] { self->work(); });
  }

  /// On a worker, without the lock: the state keeps everyone else away from the message.
  void work() {
    bool more = false;
    message_.Clear();
    const auto status = call_.guarded([&] {
      if (!next_) {
        requireWellFormed(request_);
        next_ = begin_(request_, call_);
      }
      more = next_(message_, call_);
    });
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!status.ok() || !more) return end(status);
    if (call_.stopped()) return end(call_.stopStatus());
    write();
  }

  void write() {
    state_ = State::kWriting;
    const auto patience = std::chrono::duration_cast<DeadlineTimer::Clock::duration>(runtime_.write_patience);
    const auto given_up = DeadlineTimer::Clock::now() + patience;
    const auto deadline = call_.deadline();
    stopAt(std::min(given_up, deadline), deadline < given_up ? StopReason::kDeadline : StopReason::kReader);
    this->StartWrite(&message_);
  }

  void OnWriteDone(bool ok) override {
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (!ok) call_.stop(StopReason::kClient);
    call_.stopped() ? end(call_.stopStatus()) : queue();
  }

  void onStop(StopReason reason) {
    call_.stop(reason);
    const bool withdrawn = pool_.withdraw(call_.id());
    const Lock lock(mutex_);
    if (state_ == State::kEnded) return;
    if (withdrawn) return end(call_.stopStatus());
    // A write that waits for a client who does not read would wait for ever. A worker sees the stop by itself.
    if (state_ == State::kWriting) context_.TryCancel();
  }

  void end(const grpc::Status& status) {
    state_ = State::kEnded;
    if (!call_.finishOnce(status)) return;
    pool_.leave(call_.id());  // before the answer, as PooledCall does
    this->Finish(status);
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
  Begin begin_;
  Next next_;
  std::recursive_mutex mutex_;
  State state_ = State::kWorking;
  DeadlineTimer::Id timer_;
  Response message_;
  std::shared_ptr<OutgoingStreamCall> self_;
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
