#include "core/skeleton/pose.h"

#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

void requireRows(const Skeleton& skeleton, const Vertices& values, const std::string& field) {
  if (values.rows() != skeleton.jointCount())
    throw InvalidInput(field, "has " + std::to_string(values.rows()) + " rows, want one for each of " +
                                  std::to_string(skeleton.jointCount()) + " joints");
  for (Eigen::Index j = 0; j < values.rows(); ++j)
    if (!values.row(j).allFinite()) throw InvalidInput(field + "[" + std::to_string(j) + "]", "is not finite");
}

}  // namespace

Pose restPose(const Skeleton& skeleton) { return {Eigen::Vector3d::Zero(), Vertices::Zero(skeleton.jointCount(), 3)}; }

PosedSkeleton poseSkeleton(const Skeleton& skeleton, const Vertices& rest_joints, const Pose& pose) {
  requireRows(skeleton, rest_joints, "rest_joints");
  requireRows(skeleton, pose.rotations, "pose.rotations");
  if (!pose.translation.allFinite()) throw InvalidInput("pose.translation", "is not finite");
  PosedSkeleton posed{{}, rest_joints};
  posed.joints.row(0) += pose.translation.transpose();
  posed.rotations.push_back(rotationMatrix(pose.rotations.row(0).transpose()));
  for (std::int32_t j = 1; j < skeleton.jointCount(); ++j) {
    const std::int32_t parent = skeleton.parent(j);
    const Eigen::Matrix3d& carrier = posed.rotations[static_cast<std::size_t>(parent)];
    const Eigen::RowVector3d bone = rest_joints.row(j) - rest_joints.row(parent);
    posed.joints.row(j) = posed.joints.row(parent) + bone * carrier.transpose();
    posed.rotations.push_back(carrier * rotationMatrix(pose.rotations.row(j).transpose()));
  }
  return posed;
}

}  // namespace shaped
