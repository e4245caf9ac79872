#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "server/jobs/job_registry.h"
#include "server/jobs/job_runner.h"
#include "server/rpc/call.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

/// Streams a job's states until it has ended. Woken by the registry, holds no thread while nothing happens; while a
/// message is on its way, changes are merged into the next one. What the job tells (JobNews) is part of a
/// WatchJobResponse each, and merged into them.
class WatchCall final : public grpc::ServerWriteReactor<v1::WatchJobResponse>,
                        public std::enable_shared_from_this<WatchCall> {
 public:
  /// stop: fires when the daemon stops.
  WatchCall(Runtime& runtime, JobRegistry& registry, const JobRunner& runner, grpc::CallbackServerContext& context,
            std::string job, std::stop_token stop);
  void enter(const v1::WatchJobRequest& request);

 private:
  void onChange();
  void onDaemonStops();
  void writeNext();
  bool addNews();
  void end(const grpc::Status& status);
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  JobRegistry& registry_;
  const JobRunner& runner_;
  Call call_;
  const std::string job_;
  const std::stop_token stop_;
  std::recursive_mutex mutex_;  // gRPC may run a reaction inside the call that causes it
  bool writing_ = false, changed_ = false, last_ = false;
  v1::WatchJobResponse message_;
  std::shared_ptr<const JobNews> news_;  ///< once the job has run
  std::size_t told_ = 0;                 ///< of these
  std::shared_ptr<const JobRegistry::Listener> listener_;
  std::optional<std::stop_callback<std::function<void()>>> on_daemon_stops_;
  std::shared_ptr<WatchCall> self_;
};

}  // namespace shaped::server
