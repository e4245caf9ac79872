#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "server/convert/limits.h"
#include "server/datasets/dataset_store.h"
#include "server/jobs/job_runner.h"
#include "server/models/model_store.h"
#include "server/telemetry/metrics.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

/// What jobs of all kinds work on; outlives them.
struct JobContext {
  DatasetStore& datasets;
  ModelStore& models;
  Metrics& metrics;
  const Limits& limits;
  std::chrono::duration<double> publish_patience;  ///< how long what is done waits for room on a full disk
  std::chrono::duration<double> checkpoint_every;  ///< time between two checkpoints
  std::filesystem::path trainer;                   ///< the program shaped-trainer, which need not be there
};

/// Where requests start jobs.
struct JobDesk {
  const JobContext& context;
  const JobRegistry& registry;
  JobRunner& runner;
};

/// A full disk must not cost hours of work: writes, and tries again until there is room, the context's patience ends
/// (then throws what `write` threw) or the job is stopped (then throws Stopped).
void patiently(const JobContext& context, const JobRun& run, const std::function<void()>& write);

/// The model of a job; waits while it is being loaded. Throws as ModelStore::pin, and Stopped.
ServedModelPtr pinForJob(const JobContext& context, const JobRun& run, const v1::ModelSelector& model);

/// Names the version that is served, so that a job has the same model whenever it runs.
void nameVersion(const ServedModel& served, v1::ModelSelector& model);

/// Lets a request that is repeated name the version that its job was given, so that the two are the same request.
/// known: what that job was asked.
void repeatVersion(const v1::ModelSelector& known, v1::ModelSelector& model);

/// "NAME@VERSION".
std::string textOf(const v1::ModelSelector& model);

/// Throws InvalidInput naming "dataset" unless it is of the model's connectivity.
void requireConnectivity(const ServedModel& model, const DatasetInfo& dataset);

/// A hash of the shapes: a dataset may be deleted, and its name given to others, while a job waits to go on.
std::string fingerprintOf(const Dataset& dataset);

/// A record to be: what every kind says of its job.
JobRecord newJob(const std::string& kind, std::string request, const std::string& request_id);

/// The job that was made by this request_id, unless it is empty. Throws InvalidInput naming "request_id".
std::optional<JobRecord> earlierJob(const JobDesk& desk, const std::string& request_id);

[[noreturn]] void throwUnreadable(const JobRecord& job);
/// The request that a job was made for. Throws Corrupted.
template <class Request>
Request requestOf(const JobRecord& job) {
  Request request;
  if (!request.ParseFromString(job.request)) throwUnreadable(job);
  return request;
}

}  // namespace shaped::server
