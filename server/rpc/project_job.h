#pragma once

#include "server/rpc/call.h"
#include "server/rpc/job_context.h"

namespace shaped::server {

inline constexpr const char* kProject = "project";

/// How a job of kind kProject is done: its request is a serialised ProjectJobRequest.
JobKind projection(const JobContext& context);

/// Checks the request and starts its job. Throws InvalidInput naming the field, ModelNotFound, NotFound for the
/// dataset, Busy, AlreadyExists; Waiting while the model is being loaded.
JobRecord startProjection(const JobDesk& desk, v1::ProjectJobRequest request, Call& call);

}  // namespace shaped::server
