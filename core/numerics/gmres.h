#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

namespace shaped {

/// Applies a linear map: y = A x, sizes as given.
using LinearMap = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& y)>;

/// Solves A x = b by GMRES with the preconditioner applied from the left (y = M^-1 x), from x = 0, in at most `limit`
/// steps or until the preconditioned residual falls by `reduction` or the stop token fires. Returns the reduction
/// reached.
double gmres(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b, double reduction,
             int limit, Eigen::VectorXd& x, const std::stop_token& stop = {});

}  // namespace shaped
