#pragma once

#include <string>
#include <vector>

#include "core/markers/marker_set.h"
#include "core/mesh/types.h"
#include "shaped/v1/motion.pb.h"

namespace shaped::server {

/// The markers of a set in the order of `labels`, or in the set's own where there are none. Throws InvalidInput naming
/// marker_set.markers[i] or labels[i]: an empty label, one that stands twice or that the set lacks, a marker without a
/// place, weights or an offset that are not three finite numbers. Whether places are on a model is for the model to
/// say.
MarkerSet markerSetFromProto(const v1::MarkerSet& message,
                             const google::protobuf::RepeatedPtrField<std::string>& labels);

/// L x 3; a marker with a NaN becomes a row of NaN. Throws InvalidInput naming `field`.positions for another count or
/// an infinite number.
Vertices markersFromProto(const v1::MarkerFrame& frame, Eigen::Index count, const std::string& field = "frame");

}  // namespace shaped::server
