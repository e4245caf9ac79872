#pragma once

#include "server/rpc/job_context.h"

namespace shaped::server {

/// Every kind of job and how it is done. To add one: its work and the checks of its request in a file of its own, a line
/// here, a method in jobs.proto with its line in server/security/roles.cpp, and one in docs/operations.md.
JobRunner::Kinds jobKinds(const JobContext& context);

}  // namespace shaped::server
