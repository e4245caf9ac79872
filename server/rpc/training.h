#pragma once

#include "server/rpc/job_context.h"

namespace shaped::server {

inline constexpr const char* kTrainShellPga = "train_shell_pga";

/// How a job of kind kTrainShellPga is done: its request is a serialised TrainRequest.
JobKind shellPgaTraining(const JobContext& context);

/// Checks a request of any method and starts its job. Throws InvalidInput naming the field, NotFound for the dataset,
/// Busy, AlreadyExists for a request_id of another request; for a bootstrap what prepareBootstrap does.
JobRecord startTraining(const JobDesk& desk, v1::TrainRequest request);

}  // namespace shaped::server
