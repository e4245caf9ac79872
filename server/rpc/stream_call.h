#pragma once

#include <grpcpp/support/server_callback.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

#include "server/rpc/call.h"

namespace shaped::server {

/// The life of a call whose messages are worked on one at a time: it takes a place in a pool once, has a worker only
/// while a message is worked on, and ends once, whoever ends it: its work, its client or its deadline. A stop while it
/// waits for anybody else ends it at once. Owns itself until gRPC is done with it.
class StreamCall : public std::enable_shared_from_this<StreamCall> {
 public:
  StreamCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context);
  virtual ~StreamCall() = default;
  StreamCall(const StreamCall&) = delete;
  StreamCall& operator=(const StreamCall&) = delete;

  /// Takes a place and begins; or ends, where there is none.
  void enter();

 protected:
  enum class State { kReading, kWorking, kParked, kWriting, kEnded };
  // Held by every function below but work(), onStop() and forget(). It is recursive because gRPC may run a reaction
  // inside the call that causes it.
  using Lock = std::scoped_lock<std::recursive_mutex>;

  /// There is a place: reads or queues what comes first.
  virtual void begin() = 0;
  /// On a worker, without the lock: the state keeps everyone else away from the messages.
  virtual void work() = 0;
  /// The reactor's Finish.
  virtual void finish(const grpc::Status& status) = 0;

  /// Has a worker run work(). bytes: of the message that it works on.
  void queue(std::size_t bytes);
  /// Stops the call when its client lets the server wait for longer than streams may be silent.
  void awaitClient();
  /// Instead of the time that was set before.
  void stopAt(DeadlineTimer::Clock::time_point when, StopReason reason);
  void end(const grpc::Status& status);
  void endStopped() { end(call_.stopStatus()); }
  /// From any thread.
  void onStop(StopReason reason);
  /// gRPC is done with the call; this may be its end.
  void forget();

  Call& call() { return call_; }
  Runtime& runtime() { return runtime_; }
  bool cancelled() const { return context_.IsCancelled(); }

  std::recursive_mutex mutex_;
  State state_ = State::kReading;

 private:
  Runtime& runtime_;
  WorkerPool& pool_;
  grpc::CallbackServerContext& context_;
  Call call_;
  DeadlineTimer::Id timer_;
  std::shared_ptr<StreamCall> self_;
};

}  // namespace shaped::server
