#pragma once

#include <span>
#include <vector>

#include "core/body/body_fit.h"

namespace shaped {

/// The weighted distances that fitBody squares, and their derivatives. Rows: the targets, one each with a normal and
/// three without; then the identity's coefficients and the joints' rotations, as the priors see them.
///
/// Parameters come in blocks: identity (k), placement (translation and the root's rotation, 6) and, where there are
/// joints beside the root, their rotations (3 J - 3).
class BodyResiduals {
 public:
  /// model, targets: must outlive it. Weights and options must be valid.
  BodyResiduals(const BodyModel& model, std::span<const SurfaceTarget> targets, const BodyFitOptions& options);

  Eigen::Index count() const { return target_rows_ + prior_rows_; }
  std::vector<Eigen::Index> blockSizes() const;

  /// values: count() numbers; jacobians: null, or one row-major count() x size array a block, any of them null. False
  /// when the parameters give nothing finite.
  bool evaluate(double const* const* parameters, double* values, double** jacobians) const;

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Jacobians;

  BodyState stateOf(double const* const* parameters) const;
  void addTargets(const PosedSkin& skin, double* values, Jacobians* jacobians) const;
  void addPriors(const BodyState& state, double* values, Jacobians* jacobians) const;

  const BodyModel& model_;
  std::span<const SurfaceTarget> targets_;
  Eigen::Index joint_size_, target_rows_ = 0, prior_rows_;
  double scale_, identity_prior_, joint_prior_;
};

}  // namespace shaped
