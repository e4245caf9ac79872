#include "core/clothing/limb_poses.h"

#include <Eigen/Geometry>
#include <optional>
#include <set>
#include <utility>

#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// The rotation that takes the bone where `rotation` takes it, by the shortest way.
Eigen::Matrix3d withoutTwist(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& bone) {
  return Eigen::Quaterniond::FromTwoVectors(bone, rotation * bone).toRotationMatrix();
}

std::vector<std::int32_t> branch(const Skeleton& skeleton, std::int32_t root) {
  std::vector<std::int32_t> joints;
  for (std::int32_t j = root; j < skeleton.jointCount(); ++j)
    if (hangsBelow(skeleton, j, root)) joints.push_back(j);
  return joints;
}

std::int32_t depth(const Skeleton& skeleton, std::int32_t joint) {
  std::int32_t count = 0;
  while ((joint = skeleton.parent(joint)) >= 0) ++count;
  return count;
}

/// Two branches of one joint, joint by joint.
struct Branches {
  std::vector<std::int32_t> one, other;
};

/// The branches that hold two limbs and hang from one joint, where they are built alike.
std::optional<Branches> branchesOf(const Skeleton& skeleton, std::int32_t one, std::int32_t other) {
  if (depth(skeleton, one) != depth(skeleton, other) || hangsBelow(skeleton, other, one)) return std::nullopt;
  while (skeleton.parent(one) != skeleton.parent(other)) one = skeleton.parent(one), other = skeleton.parent(other);
  Branches pair{branch(skeleton, one), branch(skeleton, other)};
  if (pair.one.size() != pair.other.size()) return std::nullopt;
  for (std::size_t i = 0; i < pair.one.size(); ++i)
    if (depth(skeleton, pair.one[i]) != depth(skeleton, pair.other[i])) return std::nullopt;
  return pair;
}

/// Whether a bone is as long as another, and mirrored across the plane between them.
bool mirrored(const Vertices& joints, const Limb& one, const Limb& other, const Eigen::RowVector3d& across) {
  const Eigen::RowVector3d bone = joints.row(one.lower) - joints.row(one.upper),
                           twin = joints.row(other.lower) - joints.row(other.upper);
  return (bone - 2 * bone.dot(across) * across - twin).norm() < 0.1 * bone.norm();
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

std::vector<Pose> exchangedLimbs(const Skeleton& skeleton, const Vertices& rest_joints, std::span<const Limb> limbs,
                                 const Pose& pose) {
  std::vector<Pose> poses;
  std::set<std::int32_t> taken;
  for (std::size_t i = 0; i < limbs.size(); ++i)
    for (std::size_t k = i + 1; k < limbs.size(); ++k) {
      const auto pair = branchesOf(skeleton, limbs[i].upper, limbs[k].upper);
      if (!pair || taken.count(pair->one[0]) || taken.count(pair->other[0])) continue;
      Eigen::RowVector3d across = rest_joints.row(limbs[k].upper) - rest_joints.row(limbs[i].upper);
      across.normalize();
      if (!mirrored(rest_joints, limbs[i], limbs[k], across)) continue;
      taken.insert({pair->one[0], pair->other[0]});
      poses.push_back(pose);
      for (std::size_t j = 0; j < pair->one.size(); ++j)
        for (const auto& [to, from] : {std::pair{pair->one[j], pair->other[j]}, {pair->other[j], pair->one[j]}}) {
          // M R M of a mirror M turns about -M w.
          const Eigen::RowVector3d turn = pose.rotations.row(from);
          poses.back().rotations.row(to) = 2 * turn.dot(across) * across - turn;
        }
    }
  return poses;
}

}  // namespace shaped
