#pragma once

#include <functional>
#include <vector>

#include "client/connection.h"
#include "core/markers/marker_set.h"
#include "core/mesh/types.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::client {

v1::MarkerSet pack(const MarkerSet& set);

/// Frames of markers on their way to the daemon.
struct MarkerFrames {
  std::vector<std::int64_t> numbers;                       ///< frame numbers, for the answers
  std::function<Vertices(std::int64_t number)> positions;  ///< L x 3 in the order of the set [m]; NaN where not seen
};

/// A frame as the wire has it.
v1::MarkerFrame packFrame(const MarkerFrames& frames, std::int64_t number);

/// Streams the frames and hears an answer for each, in order, while later frames are still being sent.
/// Throws RpcError when the daemon refuses or the call is aborted, and whatever `frames` and `answer`
/// throw.
void fitMarkers(const std::shared_ptr<grpc::Channel>& channel, const v1::FitMarkersRequest::Setup& setup,
                const MarkerFrames& frames, const CallOptions& options,
                const std::function<void(const v1::FitMarkersResponse&)>& answer);

}  // namespace shaped::client
