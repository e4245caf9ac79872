#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/types.h"
#include "core/skeleton/skeleton.h"

namespace shaped {

/// How a skeleton stands. Every frame is aligned with the world's axes at rest, also those of children.
struct Pose {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< of the root joint from where it rests, m
  Vertices rotations;  ///< J x 3: axis-angle of each joint relative to its parent, radians; the root's turns the body
};

/// Every joint at rest.
Pose restPose(const Skeleton& skeleton);

/// Where the bones stand. Bone j carries the space around it: x -> rotations[j] (x - rest_j) + joints.row(j).
struct PosedSkeleton {
  std::vector<Eigen::Matrix3d> rotations;  ///< J, in the world
  Vertices joints;                         ///< J x 3, m
};

/// Forward kinematics: G_j = G_parent exp(w_j), p_j = p_parent + G_parent (rest_j - rest_parent); the root's are
/// exp(w_0) and rest_0 + translation. rest_joints: J x 3, m.
/// Throws InvalidInput naming `pose.rotations`, `pose.translation` or `rest_joints` on a wrong count or a number that
/// is not finite.
PosedSkeleton poseSkeleton(const Skeleton& skeleton, const Vertices& rest_joints, const Pose& pose);

}  // namespace shaped
