#pragma once

#include <memory>

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "server/rpc/incoming_stream_call.h"
#include "shaped/v1/registration.pb.h"

namespace shaped::server {

/// Registration.Register on a solver thread: translate, call, translate. Throws as statusOf says.
void registerOne(ModelStore& store, const Limits& limits, const v1::RegisterRequest& request,
                 v1::RegisterResponse& response, Call& call);

/// Registration.RegisterSequence: what the next scan starts from lives as long as its stream.
std::unique_ptr<StreamHandler<v1::RegisterSequenceRequest, v1::RegisterResponse>> makeScanStream(ModelStore& store,
                                                                                                 const Limits& limits);

}  // namespace shaped::server
