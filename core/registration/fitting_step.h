#pragma once

#include <stop_token>

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

/// Moves the state to the minimum of the pulls plus stiffness times the deformation's quadratic bound in the state: the
/// closed-form step of Amberg, Romdhani, Vetter 2007 (section 4). What neither the pulls nor the deformation decide
/// stays as it is. False, and the state is unchanged, when the stop token fired or the system is not positive definite
/// (not finite).
bool fittingStep(const Deformation& deformation, const Pulls& pulls, double stiffness, Eigen::MatrixXd& state,
                 const std::stop_token& stop = {});

}  // namespace shaped
