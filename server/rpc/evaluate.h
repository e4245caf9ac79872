#pragma once

#include "server/datasets/dataset_store.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

/// Shapes.Evaluate, in an arena of `threads` threads.
void evaluate(ModelStore& models, DatasetStore& datasets, int threads, const v1::EvaluateRequest& request,
              v1::EvaluateResponse& response, Call& call);

}  // namespace shaped::server
