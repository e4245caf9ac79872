#pragma once

#include "server/jobs/job_record.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

void toProto(const JobRecord& record, v1::Job& job);

}  // namespace shaped::server
