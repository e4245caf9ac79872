#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/numerics/solved.h"
#include "server/errors/status.h"
#include "server/rpc/call_times.h"
#include "server/rpc/caller.h"
#include "server/rpc/wire_message.h"
#include "server/scheduling/deadline_timer.h"
#include "server/scheduling/stopper.h"
#include "server/scheduling/worker_pool.h"
#include "server/telemetry/metrics.h"
#include "trace/trace_context.h"

namespace shaped::server {

/// What calls run on; outlives them all.
struct Runtime {
  WorkerPool& pool;   ///< solvers
  WorkerPool& light;  ///< what takes milliseconds and must work while the solvers are busy: lists, uploads, jobs
  WorkerPool& heavy;  ///< what takes minutes and must not keep others from a solver: evaluations, say
  DeadlineTimer& timer;
  Metrics& metrics;
  std::atomic<std::chrono::duration<double>>
      longest_call;  ///< cap on a call's deadline; for streams, on the time between messages
  std::chrono::duration<double> longest_heavy_call;
  std::chrono::duration<double> write_patience;  ///< how long a worker waits for a client to take a message
  int threads;                                   ///< of the arena of one heavy call
  const Access* access;                          ///< knows the callers; null when nobody is asked who he is

  /// On the work of a call, or of a message of a stream, in this pool.
  std::chrono::duration<double> cap(const WorkerPool& chosen) const {
    return &chosen == &heavy ? longest_heavy_call : longest_call.load();
  }
};

/// What every call has, whatever its shape: an id, a place in a trace, a deadline, a stop token, one line in the log,
/// its share in the counts. Handlers see this class; the reactors that own it are in unary_call.h, server_stream_call.h
/// and incoming_stream_call.h (and wait_call.h and watch_call.h, which need no worker).
class Call {
 public:
  /// method: as the counts have it, "Shapes.Project". cap: the longest that the server works on it, whatever the
  /// client's deadline. Answers with the call's own traceparent in the initial metadata.
  Call(const Runtime& runtime, grpc::CallbackServerContext& context, std::string method,
       std::chrono::duration<double> cap);

  std::uint64_t id() const { return id_; }
  /// For the pools: whose call it is and how urgent. Throws InvalidInput when its metadata do not say that properly.
  Caller caller() const;
  /// Fires when the client cancels or goes away, the deadline passes, or the daemon stops. Give it to every solver.
  std::stop_token stopToken() const { return stopper_.token(); }
  /// Throws Stopped once the token has fired.
  void throwIfStopped() const;
  /// For the log: which model answered.
  void setModel(const std::string& name, std::uint64_t version);
  /// Wall-clock seconds since a worker took up the call (its latest message, in a stream).
  double workSeconds() const;
  /// For the counts: how a solver ended.
  void solved(const Outcome& outcome) { counts_.solved(outcome); }

  // For the reactors.

  /// A message waits for a worker from now on; guarded() ends that.
  void queued() { times_.enter(CallTimes::Phase::kQueued); }
  /// Within guarded(): runs what waits for the client, which is nobody's work.
  void waitForClient(const std::function<void()>& wait);

  /// Runs a piece of work and turns its exceptions into a status, all but Waiting. A call whose metadata are faulty is
  /// told so instead.
  grpc::Status guarded(const std::function<void()>& work);
  /// Fires the token. The client's own deadline is told from a cancellation by the clock.
  void stop(StopReason reason);
  bool stopped() const { return stopper_.stopped(); }
  grpc::Status stopStatus() const { return stoppedStatus(stopper_.reason()); }
  /// The status of a refusal; puts the retry delay into the trailing metadata, where gRPC's retries look for it.
  grpc::Status refusal(const Decision& decision);
  /// The client's deadline or the server's cap from now, whichever is earlier.
  DeadlineTimer::Clock::time_point deadline() const;
  /// Writes the log line and counts; true for the first caller only, who must then finish the call.
  bool finishOnce(const grpc::Status& status);

 private:
  grpc::CallbackServerContext& context_;
  // A copy: a timer may still ask when gRPC has freed the context.
  const DeadlineTimer::Clock::time_point client_deadline_;
  Metrics& metrics_;
  const std::uint64_t id_;
  const std::string method_, client_;
  MethodMetrics& counts_;
  const std::optional<TraceContext> parent_;
  const TraceContext trace_;
  const std::chrono::duration<double> cap_;
  const std::chrono::steady_clock::time_point arrival_;
  std::chrono::steady_clock::time_point work_begin_;
  CallTimes times_;
  std::mutex model_mutex_;  // a deadline may end the call while a worker names the model
  std::string model_;
  Stopper stopper_;
  std::atomic<bool> finished_{false};
};

}  // namespace shaped::server
