#include "core/curve/reduced_solver.h"

#include <Eigen/Dense>

#include "core/numerics/bfgs.h"

namespace shaped {

Solved<Eigen::VectorXd> ReducedSolver::average(const std::vector<AverageTerm>& terms, const Eigen::VectorXd& start) {
  ReducedAverage function(space_, energy_, terms);
  if (inverse_.size() == 0 && !stop_.stop_requested()) {
    const Eigen::MatrixXd hessian = function.hessian(start);
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols());
    inverse_ = (hessian + 1e-10 * hessian.trace() * one).llt().solve(one);
  }
  if (stop_.stop_requested()) return {start, {Termination::kCancelled, 0, 0}};
  return minimiseBfgs(std::ref(function), start, inverse_, {60, tolerance_, 0, function.noise(), stop_});
}

}  // namespace shaped
