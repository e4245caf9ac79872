#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>

#include "trace/trace_context.h"

namespace shaped::client {

/// A call that the daemon (or the way to it) answered with an error.
class RpcError : public std::runtime_error {
 public:
  explicit RpcError(const grpc::Status& status);
  grpc::StatusCode code() const { return code_; }
  /// The daemon's reason (docs/api.md), "SERVER_BUSY" say; empty when something else answered.
  const std::string& reason() const { return reason_; }
  /// The field of the request that was wrong; empty where none was.
  const std::string& field() const { return field_; }
  /// When the same request may succeed, where the daemon knows.
  std::optional<std::chrono::milliseconds> retryAfter() const { return retry_after_; }

 private:
  grpc::StatusCode code_;
  std::string reason_, field_;
  std::optional<std::chrono::milliseconds> retry_after_;
};

/// Throws RpcError unless the status is OK.
void require(const grpc::Status& status);

/// How to reach a daemon, and as whom.
struct ConnectionOptions {
  std::string server;                      ///< as targetOf() reads it
  bool tls = false;                        ///< the files below ask for it too
  std::filesystem::path ca;                ///< PEM: whom to trust; empty: the authorities that the system trusts
  std::filesystem::path certificate, key;  ///< PEM: the client's own, both or neither
  std::string token;                       ///< goes with every call; empty: none
  int number = 0;                          ///< channels of different numbers do not share a connection
  bool retries = true;                     ///< whether calls that may be repeated are, when they fail

  bool encrypted() const { return tls || !ca.empty() || !certificate.empty() || !key.empty(); }
};

/// Opens a channel to a daemon; connects on first use. Shared by all stubs of a program. Several replicas take calls in
/// turn, and calls that change nothing are tried again when a replica dies under them. Throws InvalidInput naming the
/// file that cannot be read or the option that is missing, and rather than send a token in the clear to another
/// machine.
std::shared_ptr<grpc::Channel> connect(const ConnectionOptions& options);

/// The trace that this process belongs to: the one that the environment's TRACEPARENT names, when it is valid, else one
/// of its own, for as long as it lives.
const TraceContext& processTrace();

/// How long calls may take and what aborts them.
struct CallOptions {
  std::optional<std::chrono::duration<double>> timeout;  ///< of each call; none: the daemon's own limit
  std::stop_token stop;                                  ///< cancels the call on the daemon too
  std::optional<TraceContext> trace{};                   ///< what the call is made on behalf of; none: processTrace()
  std::string priority{};                                ///< "interactive", "normal", "batch"; empty: normal
};

/// The context of one call; must outlive it. Carries a traceparent with a span id of its own.
class Call {
 public:
  explicit Call(const CallOptions& options);
  grpc::ClientContext* context() { return &context_; }

 private:
  grpc::ClientContext context_;
  std::stop_callback<std::function<void()>> on_stop_;
};

}  // namespace shaped::client
