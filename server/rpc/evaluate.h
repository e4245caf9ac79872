#pragma once

#include "core/model/shell_pga_evaluation.h"
#include "server/datasets/dataset_store.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "server/rpc/job_context.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

/// Shapes.Evaluate, in an arena of `threads` threads.
void evaluate(ModelStore& models, DatasetStore& datasets, int threads, const v1::EvaluateRequest& request,
              v1::EvaluateResponse& response, Call& call);

inline constexpr const char* kEvaluate = "evaluate";

/// How a job of kind kEvaluate is done: its request is a serialised EvaluateJobRequest.
JobKind evaluation(const JobContext& context);

/// Checks the request and starts its job. Throws as Shapes.Evaluate; Busy, AlreadyExists; Waiting while the model is
/// being loaded.
JobRecord startEvaluation(const JobDesk& desk, v1::EvaluateJobRequest request, Call& call);

}  // namespace shaped::server
