#pragma once

#include "core/geodesic/geodesic.h"

namespace shaped {

/// Solves the force balance at `current`, force W,2[previous, current] + W,1[current, x] = 0, for x near `start`
/// ([HZRS18] (23) with the next shape unknown; force = 1 there).
///
/// No energy has this equation as its gradient, so Newton's method is guarded by the forces' size in the inverse metric
/// of `current`, and where a full problem does not converge the known force is switched on in stages from `current`,
/// whose solution is known. The residual is the norm of the imbalance over the sum of the norms of the two forces.
Solved<Vertices> solveForDeformed(const ShellStructure& structure, const PairEnergy& energy, const Vertices& previous,
                                  const Vertices& current, const Vertices& start, const GeodesicOptions& options,
                                  double force = 1);

/// The same equation for x = previous and force = 1: W,2[x, current] + W,1[current, next] = 0.
Solved<Vertices> solveForUndeformed(const ShellStructure& structure, const PairEnergy& energy, const Vertices& current,
                                    const Vertices& next, const Vertices& start, const GeodesicOptions& options);

}  // namespace shaped
