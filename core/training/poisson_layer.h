#pragma once

#include <torch/types.h>

#include <memory>

#include "core/neural/jacobian_poisson.h"

namespace shaped {

/// JacobianPoisson::solve as a differentiable operation: F x 9 Jacobians to V x 3 positions, components centred at
/// `centroids` (C x 3); gradients come back by JacobianPoisson::backward. Both in double precision, whatever the type
/// of the tensor, which is the answer's too. Throws what solve() throws.
torch::Tensor poissonSolution(const torch::Tensor& jacobians, const std::shared_ptr<const JacobianPoisson>& poisson,
                              const Vertices& centroids);

}  // namespace shaped
