#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/marker_fit.h"
#include "shaped/v1/jobs.grpc.pb.h"

namespace shaped::client {

/// Throws RpcError when there is no such job.
v1::Job getJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options);

/// Follows a job until it has ended and returns its last state; `update` sees every state on the way, and what the job
/// tells of its scans.
/// Throws RpcError when the call fails or is aborted by the options; the job itself goes on.
v1::Job watchJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::WatchJobResponse&)>& update);

/// Starts a training. Throws RpcError when the daemon refuses.
v1::Job startTraining(v1::Jobs::Stub& jobs, const v1::TrainRequest& request, const CallOptions& options);

/// Start batch jobs. Throw RpcError when the daemon refuses.
v1::Job startEvaluation(v1::Jobs::Stub& jobs, const v1::EvaluateJobRequest& request, const CallOptions& options);
v1::Job startProjection(v1::Jobs::Stub& jobs, const v1::ProjectJobRequest& request, const CallOptions& options);
/// Sends a whole take and starts its job; `progress` hears how many frames have gone.
v1::Job startMarkerFit(v1::Jobs::Stub& jobs, const v1::FitMarkersJobRequest::Header& header, const MarkerFrames& frames,
                       const CallOptions& options, const std::function<void(std::int64_t)>& progress);

/// The answers of a batch job that has succeeded, in order. A stream that was cut off after some of them is begun again
/// behind these. Throws RpcError when the daemon refuses, or cuts off again and again without an answer in between, and
/// whatever `answer` throws.
void fetchResult(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::GetJobResultResponse&)>& answer);

/// Asks a job to stop. Throws RpcError when there is no such job.
v1::Job cancelJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options);

/// All jobs in one of the states (none: in any), oldest first, page by page. Throws RpcError.
std::vector<v1::Job> listJobs(v1::Jobs::Stub& jobs, const std::vector<v1::JobState>& states,
                              const CallOptions& options);

/// Forgets a job that has ended. Throws RpcError.
void deleteJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options);

}  // namespace shaped::client
