#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

#include "core/numerics/solved.h"

namespace shaped {

/// The value at x, infinite or NaN where it is not defined; the gradient goes into the second argument.
using DifferentiableFunction = std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>;

struct BfgsOptions {
  int max_iterations = 100;  ///< >= 1
  double tolerance = 1e-4;   ///< of sqrt(g^T B g / reference), > 0: of the gain that is left
  double reference = 0;      ///< a value that the function takes, > 0; 0: the one at the start
  double noise = 0;          ///< rounding error of the values
  std::stop_token stop = {};
};

/// Descends by the BFGS method (Nocedal and Wright, chapter 6) with a backtracking line search, for a few dozen
/// unknowns. inverse_hessian: the approximation B to start with, symmetric and positive definite; updated, so that a
/// similar problem can start from it. The residual is sqrt(g^T B g / reference).
Solved<Eigen::VectorXd> minimiseBfgs(const DifferentiableFunction& function, const Eigen::VectorXd& start,
                                     Eigen::MatrixXd& inverse_hessian, const BfgsOptions& options);

}  // namespace shaped
