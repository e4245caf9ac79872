#include "core/numerics/descent.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace shaped {
namespace {

constexpr double kLeast = 1e-300;  ///< reference value

/// B after a step and the change of the gradient over it, (6.17); as it was where the curvature along the step is not
/// clearly positive.
void update(Eigen::MatrixXd& inverse, const Eigen::VectorXd& step, const Eigen::VectorXd& change) {
  const double curvature = step.dot(change);
  if (!(curvature > 1e-8 * step.norm() * change.norm())) return;
  const Eigen::VectorXd image = inverse * change;
  const double scale = (1 + change.dot(image) / curvature) / curvature;
  inverse += scale * step * step.transpose() - (image * step.transpose() + step * image.transpose()) / curvature;
}

Eigen::MatrixXd regularised(const Eigen::MatrixXd& matrix) {
  constexpr double share = 1e-10;  // of the trace
  return matrix + share * matrix.trace() * Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols());
}

/// direction(x, gradient); learn(step, change of the gradient over it).
template <class Direction, class Learn>
Solved<Eigen::VectorXd> descend(const DifferentiableFunction& function, const Eigen::VectorXd& start,
                                const DescentOptions& options, const Direction& directionAt, const Learn& learn) {
  Eigen::VectorXd x = start, gradient(start.size()), next_gradient(start.size());
  double value = function(x, gradient);
  const double reference = options.reference > 0 ? options.reference : std::max({value, options.noise, kLeast});
  Outcome outcome;
  for (outcome.iterations = 0;; ++outcome.iterations) {
    outcome.termination = Termination::kNumericalFailure;
    if (!std::isfinite(value) || !gradient.allFinite()) return {start, outcome};
    const Eigen::VectorXd direction = directionAt(x, gradient);
    const double slope = direction.dot(gradient);
    outcome.residual = std::sqrt(std::max(-slope, 0.0) / reference);
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options.max_iterations) break;
    double length = 1, next = value;
    for (; length > 1e-10; length *= 0.5) {
      outcome.termination = Termination::kCancelled;
      if (options.stop.stop_requested()) return {x, outcome};
      next = function(x + length * direction, next_gradient);
      if (next <= value + 1e-4 * length * slope + options.noise) break;
    }
    outcome.termination = Termination::kStalled;
    if (!(length > 1e-10)) break;
    learn(length * direction, next_gradient - gradient);
    x += length * direction;
    value = next;
    std::swap(gradient, next_gradient);
  }
  return {x, outcome};
}

}  // namespace

Solved<Eigen::VectorXd> minimiseBfgs(const DifferentiableFunction& function, const Eigen::VectorXd& start,
                                     Eigen::MatrixXd& inverse_hessian, const DescentOptions& options) {
  return descend(
      function, start, options,
      [&](const Eigen::VectorXd&, const Eigen::VectorXd& gradient) -> Eigen::VectorXd {
        return -inverse_hessian * gradient;
      },
      [&](const Eigen::VectorXd& step, const Eigen::VectorXd& change) { update(inverse_hessian, step, change); });
}

Solved<Eigen::VectorXd> minimiseNewton(const DifferentiableFunction& function,
                                       const std::function<Eigen::MatrixXd(const Eigen::VectorXd&)>& hessian,
                                       const Eigen::VectorXd& start, const DescentOptions& options) {
  return descend(
      function, start, options,
      [&](const Eigen::VectorXd& x, const Eigen::VectorXd& gradient) -> Eigen::VectorXd {
        return -regularised(hessian(x)).llt().solve(gradient);
      },
      [](const Eigen::VectorXd&, const Eigen::VectorXd&) {});
}

Eigen::MatrixXd regularInverse(const Eigen::MatrixXd& matrix) {
  return regularised(matrix).llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

}  // namespace shaped
