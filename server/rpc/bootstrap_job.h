#pragma once

#include "server/rpc/job_context.h"

namespace shaped::server {

inline constexpr const char* kBootstrap = "bootstrap";

/// How a job of kind kBootstrap is done: its request is a serialised TrainRequest. It keeps the datasets that it works
/// on in its own folder, so that they may be deleted once it runs, and goes on from the last scan or step of the field
/// that a checkpoint knows of. Its result is one `bootstrap_round` a round.
JobKind bootstrapTraining(const JobContext& context);

/// Names the version of the template's model and the dataset that the request means, and checks the rest of it. Throws
/// InvalidInput naming the field, NotFound for a dataset or model, WrongState for a model of another kind or where
/// shaped-trainer is missing; Waiting while the model is being loaded.
void prepareBootstrap(const JobContext& context, v1::TrainRequest& request);

/// The same for a request that is repeated: it means what it meant before.
void repeatBootstrap(const JobRecord& known, v1::TrainRequest& request);

}  // namespace shaped::server
