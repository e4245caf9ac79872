#pragma once

#include "server/jobs/job_record.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

/// Throws InvalidInput naming `field` for what is no state.
JobState stateFromProto(v1::JobState state, const std::string& field);
void toProto(const JobRecord& record, v1::Job& job);

}  // namespace shaped::server
