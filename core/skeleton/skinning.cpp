#include "core/skeleton/skinning.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

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

PosedSkin::PosedSkin(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& rest,
                     const Vertices& rest_joints, const Pose& pose)
    : tree_(skeleton),
      weights_(weights),
      rest_(rest),
      rest_joints_(rest_joints),
      posed_(rest.rows(), 3),
      bones_(poseSkeleton(skeleton, rest_joints, pose)) {
  requireFit(skeleton, weights, rest);
  const Vertices shifts = weights * boneTranslations(bones_, rest_joints);
  for (Eigen::Index v = 0; v < rest.rows(); ++v) posed_.row(v) = rest.row(v) * blend(v).transpose() + shifts.row(v);
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

void PosedSkin::addLevers(Eigen::Index vertex, double share, Eigen::Matrix3Xd& levers) const {
  for (SkinWeights::InnerIterator entry(weights_, vertex); entry; ++entry) {
    const double weight = share * entry.value();
    const Eigen::Vector3d place = carried(vertex, entry.col());
    for (std::int32_t joint = std::int32_t(entry.col()); joint >= 0; joint = tree_.parent(joint))
      levers.col(joint) += weight * (place - bones_.joints.row(joint).transpose());
  }
}

void PosedSkin::poseRow(const Eigen::Matrix3Xd& levers, const Eigen::Vector3d& direction,
                        Eigen::Ref<Eigen::RowVectorXd> row) const {
  row.head<3>() = direction.transpose();
  for (std::int32_t joint = 0; joint < tree_.jointCount(); ++joint)
    row.segment<3>(3 + 3 * joint) =
        Eigen::Vector3d(levers.col(joint)).cross(direction).transpose() * turns_[std::size_t(joint)];
}

void PosedSkin::poseDerivative(Eigen::Index vertex, Eigen::Ref<Eigen::Matrix3Xd> columns) const {
  Eigen::Matrix3Xd levers = Eigen::Matrix3Xd::Zero(3, tree_.jointCount());
  addLevers(vertex, 1, levers);
  Eigen::RowVectorXd row(columns.cols());
  for (int axis = 0; axis < 3; ++axis) {
    poseRow(levers, Eigen::Vector3d::Unit(axis), row);
    columns.row(axis) = row;
  }
}

std::vector<Eigen::Matrix3Xd> PosedSkin::boneDerivatives(const Eigen::MatrixXd& joint_modes) const {
  const Eigen::Index k = joint_modes.cols();
  std::vector<Eigen::Matrix3Xd> places{joint_modes.topRows<3>()}, bones;
  for (std::int32_t j = 1; j < tree_.jointCount(); ++j) {
    const auto parent = std::size_t(tree_.parent(j));
    places.push_back(places[parent] +
                     bones_.rotations[parent] *
                         (joint_modes.block(3 * j, 0, 3, k) - joint_modes.block(3 * Eigen::Index(parent), 0, 3, k)));
  }
  for (std::size_t j = 0; j < places.size(); ++j)
    bones.push_back(places[j] - bones_.rotations[j] * joint_modes.block(3 * Eigen::Index(j), 0, 3, k));
  return bones;
}

void PosedSkin::addShapeRow(Eigen::Index vertex, double share, const Eigen::Vector3d& direction,
                            const VertexModes& vertex_modes, const std::vector<Eigen::Matrix3Xd>& bones,
                            Eigen::Ref<Eigen::RowVectorXd> row) const {
  Eigen::Vector3d at_rest = Eigen::Vector3d::Zero();  // T_i^T direction
  for (SkinWeights::InnerIterator entry(weights_, vertex); entry; ++entry) {
    const Eigen::Vector3d pull = share * entry.value() * direction;
    at_rest.noalias() += bones_.rotations[std::size_t(entry.col())].transpose() * pull;
    row.noalias() += pull.transpose() * bones[std::size_t(entry.col())];
  }
  for (int axis = 0; axis < 3; ++axis) row += at_rest[axis] * vertex_modes.row(axis);
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
