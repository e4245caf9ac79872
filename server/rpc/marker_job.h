#pragma once

#include <memory>

#include "server/rpc/incoming_stream_call.h"
#include "server/rpc/job_context.h"

namespace shaped::server {

inline constexpr const char* kFitMarkers = "fit_markers";

/// How a job of kind kFitMarkers is done. Its request begins with what its frames are, which lie in the job's input:
/// their hash and number, a line; then a serialised FitMarkersJobRequest.Header.
JobKind markerFit(const JobContext& context);

/// Jobs.FitMarkers: takes in the frames, and starts the job when all have come.
std::unique_ptr<StreamHandler<v1::FitMarkersJobRequest, v1::FitMarkersJobResponse>> makeTakeUpload(const JobDesk& desk);

}  // namespace shaped::server
