#include "core/skeleton/skinning.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <utility>

#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// Bone j carries the space around it: x -> rotations[j] x + row j.
Vertices boneTranslations(const PosedSkeleton& bones, const Vertices& rest_joints) {
  Vertices translations = bones.joints;
  for (Eigen::Index j = 0; j < translations.rows(); ++j)
    translations.row(j) -= rest_joints.row(j) * bones.rotations[std::size_t(j)].transpose();
  return translations;
}

void requireFit(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& rest) {
  if (weights.rows() != rest.rows() || weights.cols() != skeleton.jointCount())
    throw InvalidInput("weights", "is " + std::to_string(weights.rows()) + " x " + std::to_string(weights.cols()) +
                                      ", want one row for each of " + std::to_string(rest.rows()) +
                                      " vertices and one column for each of " + std::to_string(skeleton.jointCount()) +
                                      " joints");
}

Eigen::Matrix3d blended(const SkinWeights& weights, const PosedSkeleton& bones, Eigen::Index vertex) {
  Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
  for (SkinWeights::InnerIterator entry(weights, vertex); entry; ++entry)
    blend += entry.value() * bones.rotations[std::size_t(entry.col())];
  return blend;
}

}  // namespace

Eigen::VectorXd toVector(const Pose& pose) {
  Eigen::VectorXd vector(3 + pose.rotations.size());
  vector << pose.translation, Eigen::Map<const Eigen::VectorXd>(pose.rotations.data(), pose.rotations.size());
  return vector;
}

Pose poseFrom(const Eigen::VectorXd& vector) {
  return {vector.head<3>(), Eigen::Map<const Vertices>(vector.data() + 3, vector.size() / 3 - 1, 3)};
}

PosedSkin::PosedSkin(const Skeleton& skeleton, const SkinWeights& weights, Vertices rest, Vertices rest_joints,
                     const Pose& pose)
    : tree_(skeleton),
      weights_(weights),
      rest_(std::move(rest)),
      rest_joints_(std::move(rest_joints)),
      posed_(rest_.rows(), 3),
      bones_(poseSkeleton(skeleton, rest_joints_, pose)) {
  requireFit(skeleton, weights, rest_);
  const Vertices shifts = weights * boneTranslations(bones_, rest_joints_);
  for (Eigen::Index v = 0; v < rest_.rows(); ++v) posed_.row(v) = rest_.row(v) * blend(v).transpose() + shifts.row(v);
  for (std::int32_t j = 0; j < skeleton.jointCount(); ++j) {
    const Eigen::Matrix3d own = leftJacobian(pose.rotations.row(j).transpose());
    turns_.push_back(j == 0 ? own : bones_.rotations[std::size_t(skeleton.parent(j))] * own);
  }
}

Eigen::Matrix3d PosedSkin::blend(Eigen::Index vertex) const { return blended(weights_, bones_, vertex); }

Eigen::Vector3d PosedSkin::carried(Eigen::Index vertex, Eigen::Index joint) const {
  return bones_.rotations[std::size_t(joint)] * (rest_.row(vertex) - rest_joints_.row(joint)).transpose() +
         bones_.joints.row(joint).transpose();
}

Vertices skinned(const Rig& rig, const Vertices& rest, const Pose& pose) {
  return PosedSkin(rig.skeleton, rig.weights, rest, rig.rest_joints, pose).vertices();
}

Vertices unskinned(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& posed,
                   const Vertices& rest_joints, const Pose& pose) {
  requireFit(skeleton, weights, posed);
  const PosedSkeleton bones = poseSkeleton(skeleton, rest_joints, pose);
  const Vertices shifts = weights * boneTranslations(bones, rest_joints);
  Vertices rest(posed.rows(), 3);
  for (Eigen::Index v = 0; v < posed.rows(); ++v) {
    const Eigen::Matrix3d blend = blended(weights, bones, v);
    if (std::abs(blend.determinant()) < 1e-6)
      throw InvalidInput("pose", "leaves vertex " + std::to_string(v) +
                                     " no way back: the bones that carry it stand opposite to each other");
    rest.row(v) = (blend.inverse() * (posed.row(v) - shifts.row(v)).transpose()).transpose();
  }
  return rest;
}

}  // namespace shaped
