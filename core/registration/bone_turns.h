#pragma once

#include <Eigen/Core>
#include <vector>

namespace shaped {

/// Rotations that tilt a bone by each of the angles in eight directions, each after every twist about it; untilted ones
/// too. bone: its direction, not zero; angles in degrees. The first is the first twist alone.
std::vector<Eigen::Matrix3d> boneTurns(const Eigen::Vector3d& bone, const std::vector<double>& tilts,
                                       const std::vector<double>& twists);

}  // namespace shaped
