#pragma once

#include <chrono>

#include "server/datasets/dataset_store.h"
#include "server/jobs/job_runner.h"
#include "server/models/model_store.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

/// What training jobs work on; outlives them.
struct TrainingContext {
  DatasetStore& datasets;
  ModelStore& models;
  JobRunner& runner;
  std::chrono::duration<double> publish_patience;  ///< how long a finished training waits for a full disk
};

/// Checks the request and starts its job. Throws InvalidInput naming the field, NotFound for the dataset, Busy.
JobRecord startTraining(const TrainingContext& context, const v1::TrainRequest& request);

}  // namespace shaped::server
