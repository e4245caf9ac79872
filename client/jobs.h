#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/connection.h"
#include "shaped/v1/jobs.grpc.pb.h"

namespace shaped::client {

/// Follows a job until it has ended and returns its last state; `update` sees every state on the way.
/// Throws RpcError when the call fails or is aborted by the options; the job itself goes on.
v1::Job watchJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::Job&)>& update);

/// Asks a job to stop. Throws RpcError when there is no such job.
v1::Job cancelJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options);

/// All jobs in one of the states (none: in any), oldest first, page by page. Throws RpcError.
std::vector<v1::Job> listJobs(v1::Jobs::Stub& jobs, const std::vector<v1::JobState>& states,
                              const CallOptions& options);

/// Forgets a job that has ended. Throws RpcError.
void deleteJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options);

}  // namespace shaped::client
