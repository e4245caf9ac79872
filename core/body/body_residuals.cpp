#include "core/body/body_residuals.h"

#include <cmath>

namespace shaped {

/// Writes the rows of targets for one state.
class BodyResiduals::TargetRows {
 public:
  TargetRows(const BodyResiduals& residuals, const BodyState& state)
      : residuals_(residuals),
        skin_(residuals.model_.posed(state)),
        bones_(skin_.boneDerivatives(residuals.model_.jointModes())),
        levers_(3, residuals.model_.skeleton().jointCount()) {}

  /// Fills residuals_.rowCount(target) rows.
  void fill(const SurfaceTarget& target, Eigen::Ref<Rows> rows) {
    Eigen::Vector3d offset = -target.position;
    levers_.setZero();
    forCorners(target, [&](std::int32_t corner, double share) {
      offset += share * skin_.vertices().row(corner).transpose();
      skin_.addLevers(corner, share, levers_);
    });
    const double scale = residuals_.scale_ * std::sqrt(target.weight);
    const Eigen::Index modes = residuals_.model_.modeCount(), last = rows.cols() - 1;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      const bool along = rows.rows() == 1;
      const Eigen::Vector3d direction = scale * (along ? target.normal : Eigen::Vector3d(Eigen::Vector3d::Unit(row)));
      auto shape = rows.row(row).head(modes);
      shape.setZero();
      forCorners(target, [&](std::int32_t corner, double share) {
        skin_.addShapeRow(corner, share, direction, residuals_.model_.vertexModes(corner), bones_, shape);
      });
      skin_.poseRow(levers_, direction, rows.row(row).segment(modes, last - modes));
      rows(row, last) = direction.dot(offset);
    }
  }

 private:
  template <class Work>
  static void forCorners(const SurfaceTarget& target, const Work& work) {
    for (int c = 0; c < 3; ++c)
      if (target.barycentric[c] != 0) work(target.corners[std::size_t(c)], target.barycentric[c]);
  }

  const BodyResiduals& residuals_;
  PosedSkin skin_;
  std::vector<Eigen::Matrix3Xd> bones_;
  Eigen::Matrix3Xd levers_;
};

BodyResiduals::BodyResiduals(const BodyModel& model, std::span<const SurfaceTarget> targets,
                             const BodyFitOptions& options, double prior_share)
    : model_(model), targets_(targets), parameters_(model.modeCount() + 3 + 3 * model.skeleton().jointCount()) {
  double weights = 0;
  for (const auto& target : targets) weights += target.weight;
  scale_ = weights > 0 ? std::sqrt(options.observations / weights) / options.sigma : 0;
  identity_prior_ = std::sqrt(options.prior * prior_share);
  joint_prior_ = std::sqrt(options.prior) / options.pose_deviation;
}

Eigen::VectorXd BodyResiduals::priorFactors() const {
  Eigen::VectorXd factors = Eigen::VectorXd::Constant(parameters_, joint_prior_);
  factors.head(model_.modeCount()).setConstant(identity_prior_);
  factors.segment<6>(model_.modeCount()).setZero();
  return factors;
}

Eigen::VectorXd BodyResiduals::priorValues(const BodyState& state) const {
  Eigen::VectorXd values(parameters_);
  values << state.identity, toVector(state.pose);
  return priorFactors().cwiseProduct(values);
}

double BodyResiduals::energy(const BodyState& state) const {
  const PosedSkin skin = model_.posed(state);
  double sum = priorValues(state).squaredNorm();
  for (const auto& target : targets_) {
    Eigen::Vector3d offset = -target.position;
    for (int c = 0; c < 3; ++c)
      offset += target.barycentric[c] * skin.vertices().row(target.corners[std::size_t(c)]).transpose();
    const double squared = rowCount(target) == 1 ? std::pow(target.normal.dot(offset), 2) : offset.squaredNorm();
    sum += scale_ * scale_ * target.weight * squared;
  }
  return sum;
}

BodyResiduals::Rows BodyResiduals::rows(const BodyState& state) const {
  Eigen::Index count = parameters_;
  for (const auto& target : targets_) count += rowCount(target);
  Rows all(count, parameters_ + 1);
  TargetRows writer(*this, state);
  Eigen::Index row = 0;
  for (const auto& target : targets_) {
    writer.fill(target, all.middleRows(row, rowCount(target)));
    row += rowCount(target);
  }
  all.bottomRows(parameters_) << Eigen::MatrixXd(priorFactors().asDiagonal()), priorValues(state);
  return all;
}

Eigen::MatrixXd BodyResiduals::squares(const BodyState& state) const {
  constexpr Eigen::Index batch = 192;  // rows that stay in the cache
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(parameters_ + 1, parameters_ + 1);
  Rows rows(batch, parameters_ + 1);
  TargetRows writer(*this, state);
  Eigen::Index filled = 0;
  const auto flush = [&] {
    if (filled == 0) return;  // Eigen divides by it
    sums.selfadjointView<Eigen::Lower>().rankUpdate(rows.topRows(filled).transpose());
    filled = 0;
  };
  for (const auto& target : targets_) {
    writer.fill(target, rows.middleRows(filled, rowCount(target)));
    filled += rowCount(target);
    if (filled + 3 > batch) flush();
  }
  flush();
  const Eigen::VectorXd factors = priorFactors(), values = priorValues(state);
  sums.diagonal().head(parameters_) += factors.cwiseAbs2();
  sums.row(parameters_).head(parameters_) += factors.cwiseProduct(values).transpose();
  sums(parameters_, parameters_) += values.squaredNorm();
  return sums.selfadjointView<Eigen::Lower>();
}

}  // namespace shaped
