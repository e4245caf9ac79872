#pragma once

#include <chrono>

#include "server/datasets/dataset_store.h"
#include "server/jobs/job_runner.h"
#include "server/models/model_store.h"
#include "server/telemetry/metrics.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

inline constexpr const char* kTrainShellPga = "train_shell_pga";

/// What training jobs work on; outlives them.
struct TrainingContext {
  DatasetStore& datasets;
  ModelStore& models;
  Metrics& metrics;
  std::chrono::duration<double> publish_patience;  ///< how long a finished training waits for a full disk
  std::chrono::duration<double> checkpoint_every;  ///< time between two checkpoints
};

/// How a job of kind kTrainShellPga is done: its request is a serialised TrainRequest.
JobKind shellPgaTraining(const TrainingContext& context);

/// Checks the request and starts its job. Throws InvalidInput naming the field, NotFound for the dataset, Busy,
/// AlreadyExists for a request_id of another request.
JobRecord startTraining(const DatasetStore& datasets, const JobRegistry& registry, JobRunner& runner,
                        const v1::TrainRequest& request);

}  // namespace shaped::server
