#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "server/jobs/job_registry.h"
#include "server/rpc/call.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

/// What a call that follows a job ends with when the daemon stops.
grpc::Status daemonStops(const std::string& job);

/// Answers when a job has ended or the time is up. Woken by the registry, holds no thread while nothing happens.
class WaitCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<WaitCall> {
 public:
  /// stop: fires when the daemon stops.
  WaitCall(Runtime& runtime, JobRegistry& registry, grpc::CallbackServerContext& context,
           const v1::WaitJobRequest& request, v1::WaitJobResponse& response, std::stop_token stop);
  void enter(const v1::WaitJobRequest& request);

 private:
  enum class Cause { kChange, kTimeUp };

  DeadlineTimer::Clock::time_point until() const;
  void look(Cause cause);
  void end(const grpc::Status& status);
  void OnCancel() override;
  void OnDone() override;

  Runtime& runtime_;
  JobRegistry& registry_;
  Call call_;
  const std::string job_;  // copies: gRPC frees the request while a listener may still look
  const std::optional<google::protobuf::Duration> timeout_;
  v1::WaitJobResponse& response_;
  const std::stop_token stop_;
  std::shared_ptr<const JobRegistry::Listener> listener_;
  DeadlineTimer::Id timer_;
  std::optional<std::stop_callback<std::function<void()>>> on_daemon_stops_;
  std::shared_ptr<WaitCall> self_;
};

}  // namespace shaped::server
