#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>

#include "server/rpc/call.h"
#include "server/rpc/parking.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {

/// The life of a call with one request: admitted or refused, queued, worked on, perhaps parked and queued again, ended
/// once. gRPC's thread only queues; a worker runs the handler. A stop while the call waits or is parked ends it at
/// once. Owns itself until gRPC is done with it.
class PooledCall : public std::enable_shared_from_this<PooledCall> {
 public:
  PooledCall(Runtime& runtime, WorkerPool& pool, std::string method, grpc::CallbackServerContext& context);
  virtual ~PooledCall() = default;
  PooledCall(const PooledCall&) = delete;
  PooledCall& operator=(const PooledCall&) = delete;

  /// bytes: of its request.
  void enter(std::size_t bytes);

 protected:
  /// On a worker: answers or throws; again from the start after it threw Waiting.
  virtual void handle() = 0;
  /// The reactor's Finish.
  virtual void finish(const grpc::Status& status) = 0;
  /// The call was stopped while a worker has it.
  virtual void interrupt() {}

  void onStop(StopReason reason);
  /// gRPC is done with the call: it may go with this.
  void forget();

  Call& call() { return call_; }  // gRPC's reactors have a call_ of their own

  Runtime& runtime_;
  grpc::CallbackServerContext& context_;

 private:
  void work();
  void park(const Waiting& waiting);
  void resume();
  void end(const grpc::Status& status);

  Call call_;
  WorkerPool& pool_;
  std::size_t bytes_ = 0;
  Parking parking_;
  DeadlineTimer::Id timer_;
  std::shared_ptr<PooledCall> self_;
};

}  // namespace shaped::server
