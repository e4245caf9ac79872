#pragma once

#include "client/connection.h"
#include "shaped/v1/admin.grpc.pb.h"

namespace shaped::client {

/// What the daemon counts, at this moment. Throws RpcError.
v1::GetStatisticsResponse getStatistics(v1::Admin::Stub& admin, const CallOptions& options);

}  // namespace shaped::client
