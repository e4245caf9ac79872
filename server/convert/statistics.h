#pragma once

#include "server/telemetry/statistics.h"
#include "shaped/v1/admin.pb.h"

namespace shaped::server {

void toProto(const Statistics& statistics, v1::GetStatisticsResponse& response);

}  // namespace shaped::server
