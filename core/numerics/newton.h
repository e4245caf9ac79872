#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

#include "core/numerics/cholesky.h"
#include "core/numerics/solved.h"

namespace shaped {

/// An energy of n points that Newton's method can descend. x, gradient: 3n entries.
class NewtonObjective {
 public:
  virtual ~NewtonObjective() = default;

  /// Infinite (or NaN) where the energy is not defined; the line search then shortens its step.
  virtual double value(const Eigen::VectorXd& x) = 0;
  /// Rounding error of value(): differences below it mean nothing.
  virtual double noise() const = 0;
  /// The gradient at x, and the norm that it is measured against: the size of the forces that balance in it.
  virtual double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) = 0;
  /// The Hessian at x; with `projected` a positive semi-definite stand-in.
  virtual void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& hessian) = 0;
  /// Unknowns held fixed, at least those that a rigid motion would leave undetermined.
  virtual Pins pins(const Eigen::VectorXd& x) = 0;
};

struct NewtonOptions {
  int max_iterations = 60;  ///< >= 1
  double tolerance = 1e-8;  ///< on |gradient| / reference norm, > 0
  std::stop_token stop;
};

/// Descends from `start` by Newton's method with a backtracking line search. The exact Hessian is used where it is
/// positive definite on the free unknowns and its projection elsewhere, so every step lowers the energy.
/// The residual is the gradient's norm on the free unknowns over the objective's reference norm.
Solved<Eigen::VectorXd> minimise(NewtonObjective& objective, const CholeskyAnalysisPtr& analysis,
                                 const Eigen::VectorXd& start, const NewtonOptions& options);

/// The longest step of {1, 1/2, 1/4, ..} along a descent direction that lowers the energy enough (Armijo's rule), or 0.
/// value(t): the energy at step t; slope: its derivative at 0, negative; noise: rounding error of the values. Close to a
/// minimum, where rounding hides the gain, the full step passes and the caller watches the gradient.
double backtrack(const std::function<double(double)>& value, double at_zero, double slope, double noise);

}  // namespace shaped
