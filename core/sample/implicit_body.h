#pragma once

#include <vector>

#include "core/mesh/types.h"
#include "core/sample/anatomy.h"

namespace shaped {

/// Signed distance (m) to a tapered capsule: the spheres around both ends and the cone that touches them.
double distanceToBone(const Bone& bone, const Eigen::Vector3d& point);

/// A function's value (m) and gradient at a point.
struct Level {
  double value;
  Eigen::Vector3d gradient;
};

/// A body as the zero level of a smooth function: tapered capsules along the bones, joined smoothly within a limb and
/// blended between limbs. Negative inside; close to a distance in metres near the surface.
class ImplicitBody {
 public:
  explicit ImplicitBody(std::vector<Bone> bones) : bones_(std::move(bones)) {}

  double value(const Eigen::Vector3d& point) const { return level(point).value; }
  Level level(const Eigen::Vector3d& point) const;
  /// The surface point that a few Newton steps along the gradient reach from a point near the surface.
  Eigen::Vector3d project(const Eigen::Vector3d& point) const;
  /// How thick the body is near a surface point, m: the bones' radii, nearer bones counting more.
  double thickness(const Eigen::Vector3d& point) const;
  /// Corners of a box that holds the body with a margin.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> bounds() const;

 private:
  std::vector<Bone> bones_;
};

}  // namespace shaped
