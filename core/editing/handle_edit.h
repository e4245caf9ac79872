#pragma once

#include "core/editing/anchored_fit.h"
#include "core/statistics/submanifold.h"

namespace shaped {

/// Handle editing (21) of [HZRS18]: the shape closest to the submanifold among those that meet the handles.
struct HandleEdit {
  Vertices shape;                      ///< s, meets the handles
  SubmanifoldProjection projection;    ///< P[s]
  std::vector<double> energies;        ///< W[s, P[s]] after each outer iteration, falling [m^2]
  double largest_handle_distance = 0;  ///< [m]
};

struct HandleEditOptions {
  int outer_iterations = 40;       ///< alternations at most, >= 1
  double tolerance = 1e-3;         ///< fall of W[s, P[s]] in one alternation, over itself, at which it has settled, > 0
  double handle_tolerance = 1e-8;  ///< largest distance of a handle over the size of the shape, > 0
  /// Looser than elsewhere: the alternation itself is not settled more closely.
  SubmanifoldOptions submanifold{.tolerance = 1e-4, .shape_tolerance = 1e-5, .stop = {}};
};

/// Minimises W[s, P[s]] subject to the handles by alternating between s (Newton's method with the handles as
/// constraints, by an augmented Lagrangian) and P[s], accelerated by extrapolation (ProjectionAccelerator). What would
/// raise the energy is not taken, so the energies fall; the outcome is converged when they settle: when one alternation
/// lowers W[s, P[s]] by less than `tolerance` of itself plus a tenth of W[mean, P[s]]. Weights of the handles are not
/// used. The handles must determine the placement (determinePlacement), else InvalidInput naming "handles".
Solved<HandleEdit> editByHandles(const Submanifold& submanifold, const std::vector<AnchorTarget>& handles,
                                 const HandleEditOptions& options);

}  // namespace shaped
