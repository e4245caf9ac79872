#include "server/daemon/daemon.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include "core/numerics/error.h"
#include "server/daemon/scrape.h"
#include "server/daemon/surroundings.h"
#include "server/field_training/trainer_process.h"
#include "server/jobs/arena.h"
#include "server/rpc/job_kinds.h"
#include "server/security/limits.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

// Lists, uploads and deletions: short, often waiting for the disk.
constexpr int kLightThreads = 2;
constexpr std::chrono::hours kLongestHeavyCall(12);
constexpr std::size_t kWaitingJobs = 64;
constexpr AdmissionLimits kHeavyLimits{.queue_length = 8,
                                       .bytes_in_flight = 64 << 20,
                                       .open_streams = 4,
                                       .client_requests = 5,
                                       .client_bytes = 64 << 20,
                                       .client_streams = 2};

/// One request, one thread: parallel loops inside a solver stay in the worker's own arena of one.
void alone(const std::function<void()>& serve) { runInArena(1, serve); }

JobLimits jobLimits(const DaemonOptions& options) {
  return {.running = 1,
          .waiting = kWaitingJobs,
          .threads = options.threads,
          .crashes = options.job_crashes,
          .retention = {options.keep_jobs, std::chrono::hours(static_cast<int>(24 * options.keep_jobs_days)),
                        static_cast<std::uintmax_t>(options.keep_results)}};
}

}  // namespace

Daemon::Daemon(const DaemonOptions& options)
    : options_(options),
      security_(options.security, options.listen),
      lock_(options.store),
      models_(options.store / "models", options.models),
      datasets_(options.store / "datasets"),
      job_registry_(options.store / "jobs.sqlite"),
      metrics_([this] { return surroundings(); }),
      pool_("solver", options.threads, options.admission, alone),
      light_("light", kLightThreads, options.admission, alone),
      heavy_("heavy", 1, kHeavyLimits, {}),
      job_context_{datasets_,
                   models_,
                   metrics_,
                   options_.limits,
                   std::chrono::duration<double>(options.publish_patience),
                   std::chrono::duration<double>(options.checkpoint_every),
                   options.trainer.empty() ? defaultTrainer() : options.trainer},
      jobs_(job_registry_, jobKinds(job_context_), jobLimits(options), options.store / "jobs",
            [this](const JobRecord& job) { metrics_.jobEnded(job.kind, nameOf(job.state)); }),
      runtime_{pool_,
               light_,
               heavy_,
               timer_,
               metrics_,
               std::chrono::duration<double>(options.longest_call),
               kLongestHeavyCall,
               std::chrono::duration<double>(options.write_patience),
               options.threads,
               security_.access()},
      models_service_(runtime_, options_.limits, models_),
      datasets_service_(runtime_, options_.limits, datasets_),
      jobs_service_(runtime_, job_context_, job_registry_, jobs_),
      shapes_service_(runtime_, options_.limits, models_, datasets_),
      curves_service_(runtime_, options_.limits, models_, datasets_),
      registration_service_(runtime_, options_.limits, models_),
      server_service_(runtime_, options_.limits, "shaped " SHAPED_VERSION),
      admin_service_(runtime_) {
  for (const char* service :
       {v1::Models::service_full_name(), v1::Datasets::service_full_name(), v1::Jobs::service_full_name(),
        v1::Shapes::service_full_name(), v1::Curves::service_full_name(), v1::Registration::service_full_name(),
        v1::Server::service_full_name(), v1::Admin::service_full_name()})
    declareMethods(service, metrics_);
  for (const auto& [kind, how] : jobKinds(job_context_))
    for (const auto state : {JobState::kSucceeded, JobState::kFailed, JobState::kCancelled})
      metrics_.declareJobs(kind, nameOf(state));
  for (auto* pool : {&pool_, &light_}) pool->setAgeing(options.ageing);
  if (!options.metrics.empty())
    scrape_ = std::make_unique<HttpListener>("--metrics", options.metrics, scrapeHandler(metrics_, ready_));
  if (options.watch_models) watch_ = std::make_unique<ModelWatch>(models_, options.store / "models");
  listen(options.listen);
  preload_ =
      std::make_unique<Preload>(models_, preloadListFrom("--preload", options.preload), [this] { becomeReady(); });
}

/// Others may be asked for while models are still on their way; what failed to load keeps nobody from the rest.
void Daemon::becomeReady() {
  const std::scoped_lock lock(readiness_);
  if (!stopping_) setServing(true);
}

/// Call with readiness_ held.
void Daemon::setServing(bool serving) {
  ready_ = serving;
  if (auto* health = server_ ? server_->GetHealthCheckService() : nullptr) health->SetServingStatus(serving);
}

Surroundings Daemon::surroundings() {
  return {{poolStatistics("solver", pool_), poolStatistics("light", light_), poolStatistics("heavy", heavy_)},
          modelMemory(models_),
          jobCounts(job_registry_),
          denialCounts(security_.access())};
}

void Daemon::listen(const std::string& address) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  int port = -1;
  builder.AddListeningPort(address, security_.transport(), &port);
  limitConnections(builder);
  builder.SetMaxReceiveMessageSize(static_cast<int>(options_.limits.message_bytes));
  builder.SetMaxSendMessageSize(static_cast<int>(options_.limits.message_bytes));
  // Two daemons on one port would share its connections at random.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  for (grpc::Service* service :
       {static_cast<grpc::Service*>(&models_service_), static_cast<grpc::Service*>(&datasets_service_),
        static_cast<grpc::Service*>(&jobs_service_), static_cast<grpc::Service*>(&shapes_service_),
        static_cast<grpc::Service*>(&curves_service_), static_cast<grpc::Service*>(&registration_service_),
        static_cast<grpc::Service*>(&server_service_), static_cast<grpc::Service*>(&admin_service_)})
    builder.RegisterService(service);
  server_ = builder.BuildAndStart();
  const bool by_port = !address.starts_with("unix:");
  if (!server_ || (by_port && port <= 0))
    throw InvalidInput("--listen", "cannot serve on " + address + "; is the address taken, or not of this machine?");
  server_->GetHealthCheckService()->SetServingStatus(false);  // until becomeReady()
  address_ = by_port ? address.substr(0, address.rfind(':')) + ":" + std::to_string(port) : address;
}

Daemon::~Daemon() { shutdown(std::chrono::seconds(0)); }

void Daemon::reload(const DaemonOptions& options) {
  const auto before = options_;
  for (const auto& spec : optionSpecs()) {
    const auto value = spec.show(options);
    if (value == spec.show(before)) continue;
    if (spec.while_running) spec.set(options_, spec.name, value);
    logInfo(spec.name + " is now " + value +
            (spec.while_running ? "" : " in the configuration: from the next start on"));
  }
  useLimits();
  security_.reload();
  logInfo("configuration read again");
}

void Daemon::useLimits() {
  setLogLevel(options_.log);
  for (auto* pool : {&pool_, &light_}) {
    pool->setLimits(options_.admission);
    pool->setAgeing(options_.ageing);
  }
  runtime_.longest_call = std::chrono::duration<double>(options_.longest_call);
}

void Daemon::announceStop() {
  const std::scoped_lock lock(readiness_);
  stopping_ = true;
  setServing(false);
}

void Daemon::shutdown(std::chrono::duration<double> grace) {
  if (!server_) return;
  announceStop();
  preload_.reset();
  watch_.reset();
  jobs_.leave();
  jobs_service_.stopWatching();
  server_->Shutdown(std::chrono::system_clock::now() +
                    std::chrono::duration_cast<std::chrono::system_clock::duration>(grace));
  server_.reset();
}

}  // namespace shaped::server
