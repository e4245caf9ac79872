#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "server/errors/status.h"
#include "server/scheduling/deadline_timer.h"
#include "server/scheduling/stopper.h"
#include "server/scheduling/worker_pool.h"
#include "server/security/access.h"

namespace shaped::server {

/// What calls run on; outlives them all.
struct Runtime {
  WorkerPool& pool;   ///< solvers
  WorkerPool& light;  ///< what takes milliseconds and must work while the solvers are busy: lists, uploads, jobs
  WorkerPool& heavy;  ///< what takes minutes and must not keep others from a solver: evaluations
  DeadlineTimer& timer;
  std::atomic<std::chrono::duration<double>>
      longest_call;  ///< cap on a call's deadline; for streams, on the time between messages
  std::chrono::duration<double> longest_heavy_call;
  std::chrono::duration<double> write_patience;  ///< how long a worker waits for a client to take a message
  int threads;                                   ///< of the arena of one heavy call
  const Access* access;                          ///< knows the callers; null when nobody is asked who he is
};

/// What every call has, whatever its shape: an id, a deadline, a stop token, one line in the log.
/// Handlers see this class; the reactors that own it are in unary_call.h, server_stream_call.h and
/// incoming_stream_call.h.
class Call {
 public:
  /// cap: the longest that the server works on it, whatever the client's deadline.
  Call(const Runtime& runtime, grpc::CallbackServerContext& context, std::string method,
       std::chrono::duration<double> cap);

  std::uint64_t id() const { return id_; }
  /// Fires when the client cancels or goes away, the deadline passes, or the daemon stops. Give it to every solver.
  std::stop_token stopToken() const { return stopper_.token(); }
  /// Throws Stopped once the token has fired.
  void throwIfStopped() const;
  /// For the log: which model answered.
  void setModel(const std::string& name, std::uint64_t version);
  /// Wall-clock seconds since a worker took up the call (its latest message, in a stream).
  double workSeconds() const;

  // For the reactors.

  /// Runs a piece of work and turns its exceptions into a status, all but Waiting.
  grpc::Status guarded(const std::function<void()>& work);
  /// Fires the token. The client's own deadline is told from a cancellation by the clock.
  void stop(StopReason reason);
  bool stopped() const { return stopper_.stopped(); }
  grpc::Status stopStatus() const { return stoppedStatus(stopper_.reason()); }
  /// The status of a refusal; puts the retry delay into the trailing metadata, where gRPC's retries look for it.
  grpc::Status refusal(const Decision& decision);
  /// The client's deadline or the server's cap from now, whichever is earlier.
  DeadlineTimer::Clock::time_point deadline() const;
  /// Writes the log line; true for the first caller only, who must then finish the call.
  bool finishOnce(const grpc::Status& status);

 private:
  grpc::CallbackServerContext& context_;
  // A copy: a timer may still ask when gRPC has freed the context.
  const DeadlineTimer::Clock::time_point client_deadline_;
  const std::uint64_t id_;
  const std::string method_, client_;
  const std::chrono::duration<double> cap_;
  const std::chrono::steady_clock::time_point arrival_;
  std::chrono::steady_clock::time_point work_begin_;
  std::mutex model_mutex_;  // a deadline may end the call while a worker names the model
  std::string model_;
  Stopper stopper_;
  std::atomic<bool> finished_{false};
};

}  // namespace shaped::server
