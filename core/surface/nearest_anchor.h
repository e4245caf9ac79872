#pragma once

#include <optional>

#include "core/mesh/anchor.h"
#include "core/mesh/topology.h"

namespace shaped {

/// The anchor at `point` on the nearest triangle of a shape. With a normal hint (any length), only triangles whose
/// normal makes less than 90 degrees with it compete, as long as there is one: so a marker on one finger does not end
/// up on the next, nor a vertex of the lips inside the mouth. Triangles without area never carry an anchor.
///
/// Looks at every triangle: for markers and other points by the hundred; ClosestPointQuery is for many.
/// Throws InvalidInput naming `point` when it is not finite, `vertices` when their count is not the topology's or no
/// triangle has area.
Anchor nearestAnchor(const Topology& topology, const Vertices& vertices, const Eigen::Vector3d& point,
                     const std::optional<Eigen::Vector3d>& normal_hint = std::nullopt);

}  // namespace shaped
