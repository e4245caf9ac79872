#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// What can be seen of a fit that did not reach the body: the inputs of a residual regression.
struct FitEvidence {
  Eigen::VectorXd offsets;  ///< V: of the scan from each vertex at rest, along its normal, m; 0 where none is near
  /// The identity in standard deviations, then the axis-angle vectors of all joints but the root in tenths of a radian:
  /// all about 1. Limbs that turned to make up for what the identities lack stand in ways that tell so.
  Eigen::VectorXd state;
};

/// A fit and what it left of the true body.
struct ResidualExample {
  FitEvidence evidence;
  Vertices residual;        ///< V x 3: the body at rest, as it lies on X_o, less X_o, m
  std::size_t subject = 0;  ///< examples of the same body are held out together
};

/// The regression as plain numbers: c = offset_weights^T offsets + state_weights^T state, residual = mean + modes c.
struct ResidualRegressionWeights {
  Eigen::MatrixXf offset_weights;  ///< V x m [1/m]
  Eigen::MatrixXf state_weights;   ///< number of state coefficients x m
  Eigen::VectorXf mean;            ///< 3 V [m]
  Eigen::MatrixXf modes;           ///< 3 V x m, orthonormal columns
};

/// What a linear model's fit to a scan leaves, as a linear function of what the fit shows of it. Ours: what a Jacobian
/// field of [Mur25] has to learn from a few dozen bodies is linear for the most part, and then known in closed form; a
/// field that starts from there has the rest to learn. Immutable; usable from several threads at once.
class ResidualRegression {
 public:
  /// Throws InvalidInput naming the part whose size does not fit or whose numbers are not finite.
  explicit ResidualRegression(ResidualRegressionWeights weights);

  /// The residual, V x 3, to be added to X_o. Throws InvalidInput naming `evidence` when its sizes are others.
  Vertices predict(const FitEvidence& evidence) const;

  const ResidualRegressionWeights& weights() const { return weights_; }
  std::size_t bytes() const;

 private:
  ResidualRegressionWeights weights_;
};

struct ResidualRegressionOptions {
  double offset_scale = 0.003;  ///< offsets count in this, m, > 0
  double state_share = 0.75;    ///< of the state's mean square beside that of the offsets over the surface, >= 0
  double kept = 0.999;          ///< share of the residuals' variance that the modes hold, > 0, <= 1

  std::optional<std::string> firstViolation() const;  ///< "kept = 0, want > 0 and <= 1"
};

struct FittedResiduals {
  /// None where predictions for held out bodies are no better than none, or there are fewer than three bodies.
  std::optional<ResidualRegressionWeights> weights;
  /// One an example, V x 3: predicted by a regression that has not seen its subject; zero where there are no weights.
  std::vector<Vertices> held_out;
  double before = 0,
         after = 0;    ///< root mean square over examples and vertices of residual, and of what is held out, m
  double penalty = 0;  ///< that was chosen, relative to the mean square of the inputs
};

/// Ridge regression in closed form. The penalty is the one with the smallest error on bodies held out in turn, of 0.01
/// to 10 times the mean square of the inputs. areas: of the vertices (lumpedAreas), which weight the offsets.
/// Throws InvalidInput naming the option or `examples[i]` when its sizes are not those of the first or of `areas`.
FittedResiduals fitResiduals(const std::vector<ResidualExample>& examples, const Eigen::VectorXd& areas,
                             const ResidualRegressionOptions& options = {});

}  // namespace shaped
