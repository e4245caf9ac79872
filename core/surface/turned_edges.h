#pragma once

#include <vector>

#include "core/mesh/topology.h"

namespace shaped {

/// Positions whose edges come nearest to those of a shape, each turned by the mean of its ends' rotations: the minimum
/// of
///   sum over edges c_ij |(y_i - y_j) - (R_i + R_j)/2 (x_i - x_j)|^2
/// with the shape's cotangent weights c_ij: Laplacian deformation with given rotations, the global step of [Sorkine and
/// Alexa 2007]. Each component is placed with its mean vertex on that of `places`.
///
/// shape, places: V x 3; rotations: V. Throws InvalidInput on other counts, or when a triangle of the shape has no area
/// (requireValidShape).
Vertices turnedEdges(const Topology& topology, const Vertices& shape, const std::vector<Eigen::Matrix3d>& rotations,
                     const Vertices& places);

}  // namespace shaped
