#pragma once

#include <grpcpp/server.h>

#include <atomic>
#include <memory>
#include <mutex>

#include "server/daemon/model_watch.h"
#include "server/daemon/options.h"
#include "server/daemon/preload.h"
#include "server/daemon/store_lock.h"
#include "server/datasets/dataset_store.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/sqlite_job_registry.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/curves_service.h"
#include "server/rpc/datasets_service.h"
#include "server/rpc/job_context.h"
#include "server/rpc/jobs_service.h"
#include "server/rpc/models_service.h"
#include "server/rpc/registration_service.h"
#include "server/rpc/server_service.h"
#include "server/rpc/shapes_service.h"
#include "server/security/security.h"
#include "server/telemetry/http_listener.h"
#include "server/telemetry/metrics.h"

namespace shaped::server {

/// Everything that serves one store at one address, with grpc.health.v1 and reflection.
class Daemon {
 public:
  /// Serves from here on. Throws InvalidInput for a bad address or a store in use, FileError for a store that cannot be
  /// written. Call limitLibraryThreads() before.
  explicit Daemon(const DaemonOptions& options);
  /// As shutdown() without grace.
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// The address in use, with the real port.
  const std::string& address() const { return address_; }
  /// The options in force.
  const DaemonOptions& options() const { return options_; }
  /// Takes over the options that may change while it runs, and logs what changed and what waits for a restart. Reads
  /// certificates and tokens anew: what is wrong with them is logged, and the old ones stay.
  void reload(const DaemonOptions& options);
  /// Health says NOT_SERVING from here on; calls are still answered.
  void announceStop();
  /// Of the scrape, with the real port; empty when there is none.
  std::string scrapeAddress() const { return scrape_ ? scrape_->address() : ""; }
  /// Takes no new calls, puts jobs back to go on at the next start, lets running calls go on for `grace`, then cancels
  /// them.
  void shutdown(std::chrono::duration<double> grace);

 private:
  void listen(const std::string& address);
  void useLimits();
  void setServing(bool serving);
  void becomeReady();
  Surroundings surroundings();

  DaemonOptions options_;
  Security security_;
  const StoreLock lock_;
  ModelStore models_;
  DatasetStore datasets_;
  SqliteJobRegistry job_registry_;
  Metrics metrics_;
  DeadlineTimer timer_;
  WorkerPool pool_, light_, heavy_;
  const JobContext job_context_;
  JobRunner jobs_;
  Runtime runtime_;
  ModelsService models_service_;
  DatasetsService datasets_service_;
  JobsService jobs_service_;
  ShapesService shapes_service_;
  CurvesService curves_service_;
  RegistrationService registration_service_;
  ServerService server_service_;
  AdminService admin_service_;
  std::string address_;
  std::atomic<bool> ready_{false};
  std::unique_ptr<grpc::Server> server_;
  std::mutex readiness_;  ///< ready_, stopping_ and what health says change together
  bool stopping_ = false;
  std::unique_ptr<HttpListener> scrape_;  // last: their threads ask for all of the above
  std::unique_ptr<ModelWatch> watch_;
  std::unique_ptr<Preload> preload_;
};

}  // namespace shaped::server
