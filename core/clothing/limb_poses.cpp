#include "core/clothing/limb_poses.h"

#include <Eigen/Geometry>

#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// The rotation that takes the bone where `rotation` takes it, by the shortest way.
Eigen::Matrix3d withoutTwist(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& bone) {
  return Eigen::Quaterniond::FromTwoVectors(bone, rotation * bone).toRotationMatrix();
}

}  // namespace

void straighten(const Skeleton& skeleton, std::int32_t joint, Pose& pose) {
  for (std::int32_t j = joint; j < skeleton.jointCount(); ++j)
    if (hangsBelow(skeleton, j, joint)) pose.rotations.row(j).setZero();
}

std::vector<Pose> otherLimbPoses(const Skeleton& skeleton, const Vertices& rest_joints, const Limb& limb,
                                 const Pose& pose, std::span<const Pose> others) {
  std::vector<Pose> poses{pose};
  straighten(skeleton, limb.lower, poses[0]);
  poses.push_back(poses[0]);
  const Eigen::Vector3d bone = (rest_joints.row(limb.lower) - rest_joints.row(limb.upper)).transpose();
  const Eigen::Matrix3d upper = rotationMatrix(pose.rotations.row(limb.upper).transpose());
  poses[1].rotations.row(limb.upper) = axisAngle(withoutTwist(upper, bone)).transpose();
  for (const auto& other : others) {
    poses.push_back(pose);
    for (std::int32_t j = limb.upper; j < skeleton.jointCount(); ++j)
      if (hangsBelow(skeleton, j, limb.upper)) poses.back().rotations.row(j) = other.rotations.row(j);
  }
  return poses;
}

}  // namespace shaped
