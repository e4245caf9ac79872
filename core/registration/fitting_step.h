#pragma once

#include <optional>
#include <stop_token>

#include "core/numerics/scalar_cholesky.h"
#include "core/registration/deformation.h"

namespace shaped {

/// What pulls at a template while its correspondences stay fixed, quadratic in the state z:
///   sum_i weight_i |x_i(z) - target_i|^2 + sum_l weight_l |landmark_l(z) - position_l|^2.
struct Pulls {
  Vertices targets;         ///< V x 3
  Eigen::VectorXd weights;  ///< V values, >= 0; a target of weight zero is not read
  struct Point {
    LinearPoint point;
    Eigen::RowVector3d target;
    double weight;
  };
  std::vector<Point> landmarks;

  double energy(const Deformation& deformation, const Eigen::MatrixXd& state) const;
  /// d energy / d state, U x 3.
  Eigen::MatrixXd gradient(const Deformation& deformation, const Eigen::MatrixXd& state) const;
};

/// Takes closed-form steps (Amberg, Romdhani, Vetter 2007, section 4) of one stiffness: each moves the state to the
/// minimum of the pulls plus stiffness times the deformation's quadratic bound in the state.
///
/// From one step to the next only the pulls' weights change, so the factor of an earlier step's system preconditions
/// conjugate gradients for the next one; where they do not get there soon the system is factorised anew.
class FittingSteps {
 public:
  /// deformation must outlive it. stiffness > 0.
  FittingSteps(const Deformation& deformation, double stiffness);

  /// What neither the pulls nor the deformation decide stays as it is. The system is solved until the residual is below
  /// `accuracy` times the one that the state had. False, and the state is unchanged, when the stop token fired or the
  /// system is not positive definite (not finite).
  bool take(const Pulls& pulls, double accuracy, Eigen::MatrixXd& state, const std::stop_token& stop = {});

 private:
  bool converge(const Eigen::SparseMatrix<double>& matrix, double accuracy, Eigen::MatrixXd& residual,
                Eigen::MatrixXd& step) const;

  const Deformation& deformation_;
  double stiffness_;
  Eigen::SparseMatrix<double> bound_;  ///< stiffness times the deformation's
  std::optional<ScalarCholesky> factor_;
};

}  // namespace shaped
