#include "core/skeleton/point_derivatives.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace shaped {
namespace {

/// How the bones' translations follow the rest joints, t_j = p_j - G_j r_j.
ShapeModes::Matrix translationModes(const PosedSkin& skin, const ShapeModes::Matrix& joints) {
  const auto& tree = skin.tree();
  const auto& rotations = skin.skeleton().rotations;
  ShapeModes::Matrix places = joints, translations(joints.rows(), joints.cols());
  for (std::int32_t j = 0; j < tree.jointCount(); ++j) {
    if (j > 0) {
      const auto parent = tree.parent(j);
      places.middleRows<3>(3 * j) =
          places.middleRows<3>(3 * parent) +
          rotations[std::size_t(parent)] * (joints.middleRows<3>(3 * j) - joints.middleRows<3>(3 * parent));
    }
    translations.middleRows<3>(3 * j) =
        places.middleRows<3>(3 * j) - rotations[std::size_t(j)] * joints.middleRows<3>(3 * j);
  }
  return translations;
}

/// Adds direction^T of three rows.
void addRow(const ShapeModes::Matrix& rows, Eigen::Index first, const Eigen::Vector3d& direction,
            Eigen::Ref<Eigen::RowVectorXd> row) {
  row += direction[0] * rows.row(first) + direction[1] * rows.row(first + 1) + direction[2] * rows.row(first + 2);
}

}  // namespace

PointDerivatives::PointDerivatives(const PosedSkin& skin) : skin_(skin), held_(4, skin.tree().jointCount()) {}

PointDerivatives::PointDerivatives(const PosedSkin& skin, const ShapeModes& modes) : PointDerivatives(skin) {
  modes_ = &modes;
  bones_ = translationModes(skin, modes.joints);
}

void PointDerivatives::turnTo(std::span<const std::int32_t> vertices, std::span<const double> shares) {
  corners_.clear();
  weights_.clear();
  held_.setZero();
  for (std::size_t c = 0; c < vertices.size(); ++c) {
    if (shares[c] == 0) continue;
    corners_.push_back({vertices[c], Eigen::Matrix3d::Zero()});
    for (SkinWeights::InnerIterator entry(skin_.weights(), vertices[c]); entry; ++entry) {
      const auto bone = std::int32_t(entry.col());
      const double weight = shares[c] * entry.value();
      held_.col(bone) += weight * skin_.carried(vertices[c], bone).homogeneous();
      corners_.back().blend += weight * skin_.skeleton().rotations[std::size_t(bone)];
      if (std::ranges::find(weights_, bone, &std::pair<std::int32_t, double>::first) == weights_.end())
        weights_.emplace_back(bone, 0);
    }
  }
  for (auto& [bone, weight] : weights_) weight = held_(3, bone);
  findJoints();
}

/// From what bones hold to what hangs on joints.
void PointDerivatives::findJoints() {
  joints_.clear();
  for (std::int32_t joint = skin_.tree().jointCount() - 1; joint > 0; --joint) {
    if (held_(3, joint) == 0) continue;
    held_.col(skin_.tree().parent(joint)) += held_.col(joint);
    joints_.push_back(joint);
  }
  joints_.push_back(0);
  std::ranges::reverse(joints_);
}

void PointDerivatives::poseRow(const Eigen::Vector3d& direction, Eigen::Ref<Eigen::RowVectorXd> row) const {
  row.head<3>() = held_(3, 0) * direction.transpose();
  for (const auto joint : joints_) {
    const Eigen::Vector3d lever =
        held_.col(joint).head<3>() - held_(3, joint) * skin_.skeleton().joints.row(joint).transpose();
    row.segment<3>(3 + 3 * joint) = lever.cross(direction).transpose() * skin_.turn(joint);
  }
}

void PointDerivatives::shapeRow(const Eigen::Vector3d& direction, Eigen::Ref<Eigen::RowVectorXd> row) const {
  row.setZero();
  for (const auto& [vertex, blend] : corners_)
    addRow(modes_->vertices, 3 * Eigen::Index(vertex), blend.transpose() * direction, row);
  for (const auto& [bone, weight] : weights_) addRow(bones_, 3 * Eigen::Index(bone), weight * direction, row);
}

}  // namespace shaped
