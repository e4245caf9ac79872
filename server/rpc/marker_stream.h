#pragma once

#include <memory>

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/incoming_stream_call.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

/// Shapes.FitMarkers: a fitter that lives as long as its stream.
std::unique_ptr<StreamHandler<v1::FitMarkersRequest, v1::FitMarkersResponse>> makeMarkerStream(ModelStore& store,
                                                                                               const Limits& limits);

}  // namespace shaped::server
