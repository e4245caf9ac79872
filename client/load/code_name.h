#pragma once

#include <grpcpp/support/status_code_enum.h>

namespace shaped::client {

/// "RESOURCE_EXHAUSTED", as gRPC's documentation spells it.
const char* codeName(grpc::StatusCode code);

}  // namespace shaped::client
