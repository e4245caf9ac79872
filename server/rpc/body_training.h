#pragma once

#include "server/rpc/job_context.h"

namespace shaped::server {

inline constexpr const char* kTrainBody = "train_body";

/// How a job of kind kTrainBody is done: its request is a serialised TrainRequest. It is a matter of minutes at most,
/// and begins anew after a stop.
JobKind bodyTraining(const JobContext& context);

/// Throws InvalidInput naming the field of `body` that is out of range or holds no rig of the dataset's meshes, or
/// "dataset" with fewer than two shapes.
void requireTrainable(const v1::BodyTraining& message, const DatasetInfo& dataset);

}  // namespace shaped::server
