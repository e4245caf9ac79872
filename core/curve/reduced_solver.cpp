#include "core/curve/reduced_solver.h"

#include "core/numerics/descent.h"

namespace shaped {

Solved<Eigen::VectorXd> ReducedSolver::average(const std::vector<AverageTerm>& terms, const Eigen::VectorXd& start,
                                               CoordinatePull pull) {
  if (stop_.stop_requested()) return {start, {Termination::kCancelled, 0, 0}};
  ReducedAverage function(space_, energy_, terms, std::move(pull));
  const DescentOptions options{60, tolerance_, 0, function.noise(), stop_};
  const auto hessian = [&](const Eigen::VectorXd& coordinates) { return function.hessian(coordinates); };
  if (method_ == AverageMethod::kNewton) return minimiseNewton(std::ref(function), hessian, start, options);
  if (inverse_.size() == 0) inverse_ = regularInverse(hessian(start));
  return minimiseBfgs(std::ref(function), start, inverse_, options);
}

}  // namespace shaped
