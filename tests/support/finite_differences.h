#pragma once

#include <functional>

#include "core/mesh/types.h"

namespace shaped::test {

/// Gradient of a function of a shape by central differences of fourth order, V x 3. step: in metres.
Vertices differenceGradient(const std::function<double(const Vertices&)>& f, const Vertices& at, double step);

/// Jacobian of a vector function of a shape by central differences of second order, one column a coordinate, row by
/// row.
Eigen::MatrixXd differenceJacobian(const std::function<Eigen::VectorXd(const Vertices&)>& f, const Vertices& at,
                                   double step);

}  // namespace shaped::test
