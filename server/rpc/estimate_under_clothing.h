#pragma once

#include <memory>

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/incoming_stream_call.h"
#include "shaped/v1/registration.pb.h"

namespace shaped::server {

/// Registration.EstimateUnderClothing: gathers the scans, estimates once the client has sent all, on `threads` threads
/// that give way to others, then answers the body and frame after frame.
std::unique_ptr<StreamHandler<v1::EstimateUnderClothingRequest, v1::EstimateUnderClothingResponse>> makeClothedStream(
    ModelStore& store, const Limits& limits, int threads);

}  // namespace shaped::server
