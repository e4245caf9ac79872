#pragma once

#include <Eigen/Core>

namespace shaped {

/// argmin over the unit simplex {x >= 0, sum x = 1} of 1/2 x^T B x + g^T x, B symmetric positive definite, n x n.
/// A primal active-set method; exact up to rounding. start: a point of the simplex.
Eigen::VectorXd minimiseOnSimplex(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, const Eigen::VectorXd& start);

}  // namespace shaped
