#pragma once

#include <span>

#include "core/body/body_fit.h"

namespace shaped {

/// The weighted distances whose squares fitBody sums, and their derivatives. Residuals: the targets, one each with a
/// normal and three without; then the identity's coefficients and the joints' rotations as the priors see them.
/// Parameters: identity (k), translation (3), then the rotations joint by joint, the root's first (3 J).
class BodyResiduals {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// model, targets: must outlive it. Weights and options must be valid. prior_share: of the identity's prior, where
  /// several bodies share one identity.
  BodyResiduals(const BodyModel& model, std::span<const SurfaceTarget> targets, const BodyFitOptions& options,
                double prior_share = 1);

  Eigen::Index parameterCount() const { return parameters_; }
  /// The sum of squares. Here and below, skin: the model in that state.
  double energy(const BodyState& state, const PosedSkin& skin) const;
  /// [J r], one row a residual: derivatives, then the residual itself.
  Rows rows(const BodyState& state, const PosedSkin& skin) const;
  /// [J r]^T [J r], symmetric: all that a least squares step needs, without a row ever being kept.
  Eigen::MatrixXd squares(const BodyState& state, const PosedSkin& skin) const;

 private:
  class TargetRows;
  class RowProducts;

  Eigen::Index rowCount(const SurfaceTarget& target) const { return target.normal.isZero(0) ? 3 : 1; }
  /// The priors are one residual a parameter, or none: factor and place.
  Eigen::VectorXd priorFactors() const;
  Eigen::VectorXd priorValues(const BodyState& state) const;

  const BodyModel& model_;
  std::span<const SurfaceTarget> targets_;
  std::vector<std::size_t> by_bone_;  ///< the targets, one bone after the other
  Eigen::Index parameters_;
  double scale_, identity_prior_, joint_prior_;
};

}  // namespace shaped
