#pragma once

#include "core/curve/reduced_path.h"

namespace shaped {

/// Lets a path in a subspace flow between its ends ([BvTH16] sections 5 and 6) until no frame has anything to gain.
/// Each frame's average is found by the BFGS method from an inverse Hessian computed once. Where averages are by (10),
/// the end is a curve of such averages and (4) need not fall to the last. The residual is the largest of the frames'.
Outcome settleByFlow(const GhostSpace& space, double bending, PathCoordinates& path, const ReducedPathOptions& options);

}  // namespace shaped
