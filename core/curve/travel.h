#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/mesh/alignment.h"

namespace shaped {

/// Positions in space between given ones: what carries shapes of one common position on their way. A rigid motion is
/// kept as a turn about a point of the body and where that point goes; turns are blended the shortest way.
class Travel {
 public:
  /// stops: motions from the common position, at least one. centre: of the body in the common position.
  Travel(const std::vector<RigidMotion>& stops, const Eigen::Vector3d& centre);

  /// At `share` of the way, in [0, 1], by de Casteljau's construction: with two stops evenly from one to the other,
  /// with more along the Bezier curve that they control.
  RigidMotion at(double share) const;

 private:
  std::vector<Eigen::Quaterniond> turns_;
  std::vector<Eigen::Vector3d> places_;  ///< of the centre
  Eigen::Vector3d centre_;
};

}  // namespace shaped
