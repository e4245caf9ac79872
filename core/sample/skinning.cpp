#include "core/sample/skinning.h"

#include <Eigen/Geometry>

#include "core/numerics/error.h"

namespace shaped {
namespace {

Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

}  // namespace

CreaturePose restPose(const SampleCreature& creature) {
  return {Eigen::Vector3d::Zero(), std::vector<Eigen::Vector3d>(creature.bones.size(), Eigen::Vector3d::Zero())};
}

std::vector<BoneMotion> boneMotions(const SampleCreature& creature, const CreaturePose& pose) {
  if (pose.rotations.size() != creature.bones.size())
    throw InvalidInput("pose.rotations", "has " + std::to_string(pose.rotations.size()) +
                                             " entries, want one for each of " + std::to_string(creature.bones.size()) +
                                             " bones");
  std::vector<BoneMotion> motions;
  for (std::size_t b = 0; b < creature.bones.size(); ++b) {
    const auto& bone = creature.bones[b];
    const Eigen::Matrix3d own = rotationMatrix(pose.rotations[b]);
    const bool root = bone.parent < 0;
    const BoneMotion parent =
        root ? BoneMotion{Eigen::Matrix3d::Identity(), pose.root} : motions[std::size_t(bone.parent)];
    const Eigen::Matrix3d rotation = parent.rotation * own;
    motions.push_back({rotation, parent.rotation * bone.joint + parent.translation - rotation * bone.joint});
  }
  return motions;
}

Vertices pose(const SampleCreature& creature, const CreaturePose& pose) {
  const auto motions = boneMotions(creature, pose);
  Vertices posed = Vertices::Zero(creature.rest.rows(), 3);
  for (std::size_t b = 0; b < motions.size(); ++b) {
    const Vertices moved =
        (creature.rest * motions[b].rotation.transpose()).rowwise() + motions[b].translation.transpose();
    posed += creature.weights.col(Eigen::Index(b)).asDiagonal() * moved;
  }
  return posed;
}

}  // namespace shaped
