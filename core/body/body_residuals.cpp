#include "core/body/body_residuals.h"

#include <cmath>

namespace shaped {

/// The blocks that are wanted; the others are empty.
struct BodyResiduals::Jacobians {
  using Block = Eigen::Map<RowMajor>;
  Block identity, placement, joints;

  bool pose() const { return placement.size() > 0 || joints.size() > 0; }
};

BodyResiduals::BodyResiduals(const BodyModel& model, std::span<const SurfaceTarget> targets,
                             const BodyFitOptions& options)
    : model_(model), targets_(targets), joint_size_(3 * model.skeleton().jointCount() - 3) {
  double weights = 0;
  for (const auto& target : targets) {
    weights += target.weight;
    target_rows_ += target.normal.isZero(0) ? 3 : 1;
  }
  prior_rows_ = model.modeCount() + joint_size_;
  scale_ = weights > 0 ? std::sqrt(options.observations / weights) / options.sigma : 0;
  identity_prior_ = std::sqrt(options.prior);
  joint_prior_ = std::sqrt(options.prior) / options.pose_deviation;
}

std::vector<Eigen::Index> BodyResiduals::blockSizes() const {
  if (joint_size_ == 0) return {model_.modeCount(), 6};
  return {model_.modeCount(), 6, joint_size_};
}

BodyState BodyResiduals::stateOf(double const* const* parameters) const {
  BodyState state{Eigen::Map<const Eigen::VectorXd>(parameters[0], model_.modeCount()), restPose(model_.skeleton())};
  state.pose.translation = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  state.pose.rotations.row(0) = Eigen::Map<const Eigen::RowVector3d>(parameters[1] + 3);
  if (joint_size_ > 0) std::copy_n(parameters[2], joint_size_, state.pose.rotations.data() + 3);
  return state;
}

bool BodyResiduals::evaluate(double const* const* parameters, double* values, double** jacobians) const {
  const BodyState state = stateOf(parameters);
  if (!state.identity.allFinite() || !state.pose.translation.allFinite() || !state.pose.rotations.allFinite())
    return false;
  const PosedSkin skin = model_.posed(state);
  const auto block = [&](int index, Eigen::Index size) -> Jacobians::Block {
    const bool wanted = jacobians && size > 0 && jacobians[index];
    return {wanted ? jacobians[index] : nullptr, wanted ? count() : 0, wanted ? size : 0};
  };
  Jacobians wanted{block(0, model_.modeCount()), block(1, 6), block(2, joint_size_)};
  addTargets(skin, values, jacobians ? &wanted : nullptr);
  addPriors(state, values, jacobians ? &wanted : nullptr);
  return true;
}

void BodyResiduals::addTargets(const PosedSkin& skin, double* values, Jacobians* jacobians) const {
  const bool identity = jacobians && jacobians->identity.size() > 0, pose = jacobians && jacobians->pose();
  const auto bones = identity ? skin.boneDerivatives(model_.jointModes()) : std::vector<Eigen::Matrix3Xd>();
  Eigen::Matrix3Xd levers(3, model_.skeleton().jointCount()), shape(3, model_.modeCount());
  Eigen::VectorXd turns(6 + joint_size_);
  Eigen::Index row = 0;
  for (const auto& target : targets_) {
    Eigen::Vector3d offset = -target.position;
    if (pose) levers.setZero();
    if (identity) shape.setZero();
    for (int c = 0; c < 3; ++c) {
      const double share = target.barycentric[c];
      if (share == 0) continue;
      const std::int32_t corner = target.corners[std::size_t(c)];
      offset += share * skin.vertices().row(corner).transpose();
      if (pose) skin.addLevers(corner, share, levers);
      if (identity) shape += share * skin.shapeDerivative(corner, model_.vertexModes(corner), bones);
    }
    const double scale = scale_ * std::sqrt(target.weight);
    const bool along = !target.normal.isZero(0);
    for (int axis = 0; axis < (along ? 1 : 3); ++axis, ++row) {
      const Eigen::Vector3d direction = scale * (along ? target.normal : Eigen::Vector3d(Eigen::Vector3d::Unit(axis)));
      values[row] = direction.dot(offset);
      if (identity) jacobians->identity.row(row) = direction.transpose() * shape;
      if (!pose) continue;
      skin.poseRow(levers, direction, turns);
      if (jacobians->placement.size() > 0) jacobians->placement.row(row) = turns.head<6>().transpose();
      if (jacobians->joints.size() > 0) jacobians->joints.row(row) = turns.tail(joint_size_).transpose();
    }
  }
}

void BodyResiduals::addPriors(const BodyState& state, double* values, Jacobians* jacobians) const {
  const Eigen::Index modes = model_.modeCount(), first = target_rows_, joints = target_rows_ + modes;
  Eigen::Map<Eigen::VectorXd>(values + first, modes) = identity_prior_ * state.identity;
  Eigen::Map<Eigen::VectorXd>(values + joints, joint_size_) =
      joint_prior_ * Eigen::Map<const Eigen::VectorXd>(state.pose.rotations.data() + 3, joint_size_);
  if (!jacobians) return;
  if (jacobians->placement.size() > 0) jacobians->placement.bottomRows(prior_rows_).setZero();
  if (jacobians->identity.size() > 0) {
    jacobians->identity.bottomRows(prior_rows_).setZero();
    jacobians->identity.block(first, 0, modes, modes).diagonal().setConstant(identity_prior_);
  }
  if (jacobians->joints.size() > 0) {
    jacobians->joints.bottomRows(prior_rows_).setZero();
    jacobians->joints.block(joints, 0, joint_size_, joint_size_).diagonal().setConstant(joint_prior_);
  }
}

}  // namespace shaped
