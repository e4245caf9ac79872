#pragma once

#include <functional>

#include "server/convert/limits.h"
#include "server/rpc/call.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

/// Shapes.Interpolate: writes the summary, then a frame for each time.
void interpolate(const Limits& limits, const v1::InterpolateRequest& request,
                 const std::function<void(v1::InterpolateResponse&&)>& write, Call& call);

}  // namespace shaped::server
