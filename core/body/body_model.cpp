#include "core/body/body_model.h"

#include <cmath>

#include "core/numerics/error.h"

namespace shaped {
namespace {

void requireSize(const char* field, Eigen::Index rows, Eigen::Index columns, Eigen::Index want_rows,
                 Eigen::Index want_columns) {
  if (rows != want_rows || columns != want_columns)
    throw InvalidInput(field, "is " + std::to_string(rows) + " x " + std::to_string(columns) + ", want " +
                                  std::to_string(want_rows) + " x " + std::to_string(want_columns));
}

void requireRowSums(const char* field, const Eigen::VectorXd& sums) {
  for (Eigen::Index row = 0; row < sums.size(); ++row)
    if (!(std::abs(sums[row] - 1) <= 1e-6))
      throw InvalidInput(field + ("[" + std::to_string(row) + "]"),
                         "sums to " + std::to_string(sums[row]) + ", want 1");
}

void requireDeviations(const Eigen::VectorXd& deviations) {
  if (deviations.size() < 1) throw InvalidInput("deviations", "is empty, want at least one mode");
  for (Eigen::Index m = 0; m < deviations.size(); ++m)
    if (!(deviations[m] > 0) || !std::isfinite(deviations[m]))
      throw InvalidInput("deviations[" + std::to_string(m) + "]", "is " + std::to_string(deviations[m]) + ", want > 0");
}

void requireParts(const BodyParts& parts) {
  if (!parts.topology) throw InvalidInput("topology", "is missing");
  const Eigen::Index vertices = parts.topology->vertexCount(), joints = parts.skeleton.jointCount();
  requireSize("mean", parts.mean.rows(), 3, vertices, 3);
  requireDeviations(parts.deviations);
  requireSize("modes", parts.modes.rows(), parts.modes.cols(), 3 * vertices, parts.deviations.size());
  requireSize("regressor", parts.regressor.rows(), parts.regressor.cols(), joints, vertices);
  if (!parts.mean.allFinite()) throw InvalidInput("mean", "is not finite");
  if (!parts.modes.allFinite()) throw InvalidInput("modes", "is not finite");
  requireRowSums("regressor", parts.regressor * Eigen::VectorXd::Ones(vertices));
  Rig{parts.skeleton, parts.regressor * parts.mean, parts.weights, parts.limits}.requireValid(std::int32_t(vertices));
}

Vertices unflattened(const Eigen::VectorXd& flat) {
  return Eigen::Map<const Vertices>(flat.data(), flat.size() / 3, 3);
}

}  // namespace

BodyModel::BodyModel(BodyParts parts) : parts_(std::move(parts)) {
  requireParts(parts_);
  shape_modes_.vertices = parts_.modes * parts_.deviations.asDiagonal();
  mean_joints_ = parts_.regressor * parts_.mean;
  shape_modes_.joints.resize(3 * skeleton().jointCount(), modeCount());
  for (Eigen::Index m = 0; m < modeCount(); ++m) {
    const Vertices joints = parts_.regressor * unflattened(shape_modes_.vertices.col(m));
    shape_modes_.joints.col(m) = Eigen::Map<const Eigen::VectorXd>(joints.data(), joints.size());
  }
}

BodyState BodyModel::meanState() const { return {Eigen::VectorXd::Zero(modeCount()), restPose(skeleton())}; }

Vertices BodyModel::rest(const Eigen::VectorXd& identity) const {
  if (identity.size() != modeCount())
    throw InvalidInput("identity",
                       "has " + std::to_string(identity.size()) + " coefficients, want " + std::to_string(modeCount()));
  return parts_.mean + unflattened(shape_modes_.vertices * identity);
}

Vertices BodyModel::restJoints(const Eigen::VectorXd& identity) const {
  return mean_joints_ + unflattened(shape_modes_.joints * identity);
}

PosedSkin BodyModel::posed(const BodyState& state) const {
  return {skeleton(), parts_.weights, rest(state.identity), restJoints(state.identity), state.pose};
}

Eigen::VectorXd BodyModel::identityOf(const Vertices& rest) const {
  requireSize("rest", rest.rows(), 3, parts_.mean.rows(), 3);
  const Vertices offset = rest - parts_.mean;
  const Eigen::VectorXd flat = Eigen::Map<const Eigen::VectorXd>(offset.data(), offset.size());
  return (parts_.modes.transpose() * flat).cwiseQuotient(parts_.deviations);
}

BodyModel BodyModel::truncated(Eigen::Index modes) const {
  if (modes < 1 || modes > modeCount())
    throw InvalidInput("modes", "is " + std::to_string(modes) + ", want 1 to " + std::to_string(modeCount()));
  BodyParts parts = parts_;
  parts.modes = parts_.modes.leftCols(modes).eval();
  parts.deviations = parts_.deviations.head(modes).eval();
  return BodyModel(std::move(parts));
}

}  // namespace shaped
