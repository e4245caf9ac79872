#pragma once

#include <stop_token>

#include "core/numerics/solved.h"
#include "core/reduction/subspace.h"
#include "core/shell/structure.h"

namespace shaped {

/// A subspace with both shapes and much of what lies on the geodesic between them, [BvTH16] section 6 after [vTSSH15]:
/// the line through both; at each of them the linearised deformation v towards the other, H v = -W,2[other, shape]; and
/// the Krylov sequences (H^-1 M)^k v, each one smoother than the last. H = W,22[shape, shape], M the lumped areas;
/// rigid motions are taken out of every direction.
///
/// b: aligned rigidly to a, which becomes the origin. dimension: at most so many directions, >= 1. Two factorisations
/// at full resolution. Cancelled once the stop token has fired; a numerical failure where a shape is too close to
/// degenerate to factorise its Hessian: the solution then is the line alone.
Solved<ShapeSubspace> krylovSubspace(const ShellStructurePtr& structure, double bending, const Vertices& a,
                                     const Vertices& b, int dimension, const std::stop_token& stop = {});

}  // namespace shaped
