#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

#include "core/numerics/solved.h"

namespace shaped {

/// The value at x, infinite or NaN where it is not defined; the gradient goes into the second argument.
using DifferentiableFunction = std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>;

/// For a few dozen unknowns, with a backtracking line search.
struct DescentOptions {
  int max_iterations = 100;  ///< >= 1
  double tolerance = 1e-4;   ///< of sqrt(g^T B g / reference), > 0: of the gain that is left
  double reference = 0;      ///< a value that the function takes, > 0; 0: the one at the start
  double noise = 0;          ///< rounding error of the values
  std::stop_token stop = {};
};

/// Descends by the BFGS method (Nocedal and Wright, chapter 6). inverse_hessian: the approximation B to start with,
/// symmetric and positive definite; updated, so that a similar problem can start from it. The residual is sqrt(g^T B g
/// / reference).
Solved<Eigen::VectorXd> minimiseBfgs(const DifferentiableFunction& function, const Eigen::VectorXd& start,
                                     Eigen::MatrixXd& inverse_hessian, const DescentOptions& options);

/// Descends by Newton's method. hessian(x): positive semi-definite there or nearly; what keeps it from being factorised
/// is met by a small multiple of one. The residual as above, with B the inverse at the iterate.
Solved<Eigen::VectorXd> minimiseNewton(const DifferentiableFunction& function,
                                       const std::function<Eigen::MatrixXd(const Eigen::VectorXd&)>& hessian,
                                       const Eigen::VectorXd& start, const DescentOptions& options);

/// The inverse of a symmetric positive semi-definite matrix to which 1e-10 of its trace was added.
Eigen::MatrixXd regularInverse(const Eigen::MatrixXd& matrix);

}  // namespace shaped
