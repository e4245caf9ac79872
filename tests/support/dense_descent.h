#pragma once

#include <Eigen/Core>
#include <functional>

namespace shaped::test {

/// A local minimiser of a smooth function by a dense quasi-Newton method (BFGS) on difference gradients, at most
/// `limit` steps: slow, for a few dozen unknowns, and independent of every solver in core. Infinite values are walls.
Eigen::VectorXd denseDescent(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                             int limit);

}  // namespace shaped::test
