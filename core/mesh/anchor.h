#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/mesh/types.h"

namespace shaped {

/// A point carried by a triangle, on it or off it: a marker on the skin, or any vertex of a finer mesh.
///
/// Its position is sum_i barycentric_i x_i + offset_0 t + offset_1 b + offset_2 n, where t is the direction of the edge
/// x0 -> x1, n the normal and b = n x t. The offset keeps its length whatever the triangle's shape. The frame is smooth
/// wherever the triangle has area; where it has none, t or n fade to zero rather than jump to infinity.
struct Anchor {
  std::int32_t face = 0;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Constant(1.0 / 3);  ///< weights of the corners, sum 1
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();                  ///< along t, b, n [m]
};

/// Where the anchor is while its triangle's corners are rows of `vertices`.
Eigen::Vector3d position(const Anchor& anchor, const Faces& faces, const Vertices& vertices);

/// d position / d (x0, x1, x2), 3 x 9: columns 3 i .. 3 i + 2 belong to corner i.
Eigen::Matrix<double, 3, 9> positionJacobian(const Anchor& anchor, const Faces& faces, const Vertices& vertices);

/// The anchor on `face` that lies at `point` now: the barycentric weights are of the point's projection into the
/// triangle (negative ones set to 0), the offset is what remains.
/// Throws InvalidInput naming `face` when it is out of range or its triangle has no area.
Anchor makeAnchor(const Faces& faces, const Vertices& vertices, std::int32_t face, const Eigen::Vector3d& point);

/// The same with given barycentric weights (sum 1), for example of the closest point.
Anchor makeAnchor(const Faces& faces, const Vertices& vertices, std::int32_t face, const Eigen::Vector3d& barycentric,
                  const Eigen::Vector3d& point);

}  // namespace shaped
