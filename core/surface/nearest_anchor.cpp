#include "core/surface/nearest_anchor.h"

#include <Eigen/Geometry>
#include <limits>
#include <string>

#include "core/numerics/error.h"
#include "core/surface/closest_point.h"

namespace shaped {
namespace {

/// The nearest triangle that faces the hint, or any side without one; nothing when none does.
std::optional<Anchor> search(const Topology& topology, const Vertices& vertices, const Eigen::Vector3d& point,
                             const std::optional<Eigen::Vector3d>& normal_hint) {
  const auto& faces = topology.faces();
  double nearest = std::numeric_limits<double>::infinity();
  std::int32_t best = -1;
  Eigen::Vector3d barycentric;
  for (std::int32_t f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d a = vertices.row(faces(f, 0)), b = vertices.row(faces(f, 1)),
                             c = vertices.row(faces(f, 2));
    const Eigen::RowVector3d area = (b - a).cross(c - a);
    if (!(area.squaredNorm() > 0) || (normal_hint && !(area.dot(normal_hint->transpose()) > 0))) continue;
    const auto closest = closestPointOnTriangle(point.transpose(), a, b, c);
    if (!(closest.squared_distance < nearest)) continue;
    nearest = closest.squared_distance;
    best = f;
    barycentric = closest.barycentric.transpose();
  }
  if (best < 0) return std::nullopt;
  return makeAnchor(faces, vertices, best, barycentric, point);
}

}  // namespace

Anchor nearestAnchor(const Topology& topology, const Vertices& vertices, const Eigen::Vector3d& point,
                     const std::optional<Eigen::Vector3d>& normal_hint) {
  if (!point.allFinite()) throw InvalidInput("point", "has a coordinate that is not a finite number");
  if (vertices.rows() != topology.vertexCount())
    throw InvalidInput(
        "vertices", "has " + std::to_string(vertices.rows()) + " rows, want " + std::to_string(topology.vertexCount()));
  if (normal_hint)
    if (const auto facing = search(topology, vertices, point, normal_hint)) return *facing;
  if (const auto any = search(topology, vertices, point, std::nullopt)) return *any;
  throw InvalidInput("vertices", "form no triangle with area");
}

}  // namespace shaped
