#pragma once

#include <stop_token>
#include <vector>

#include "core/numerics/solved.h"
#include "core/reduction/ghost_space.h"
#include "core/shell/pair_energy.h"

namespace shaped {

/// The coordinates of a path's frames in one subspace.
using PathCoordinates = std::vector<Eigen::VectorXd>;

/// How a path between fixed ends becomes a discrete geodesic.
enum class PathSolver {
  kFlow,    ///< the curve smoothing flow ([BvTH16] section 5): one frame at a time, cheap steps, many of them
  kNewton,  ///< Newton's method for (4) in all frames at once: few steps, expensive ones
};

struct ReducedPathOptions {
  PathSolver solver = PathSolver::kNewton;
  EnergySymmetry symmetry = EnergySymmetry::kSymmetric;  ///< of averages: (1) or (10); Newton's method knows (1) alone
  /// sqrt(gain that is left / energy), > 0: of each frame and its two segments for the flow, of the whole path for
  /// Newton's method.
  double tolerance = 1e-4;
  int steps = 500;  ///< at most, >= 1
  std::stop_token stop = {};
};

/// Moves a path's inner frames until they have nothing to gain any more, by the options' solver (settleByFlow(),
/// ReducedPathNewton).
Outcome settle(const GhostSpace& space, double bending, PathCoordinates& path, const ReducedPathOptions& options);

/// (4) of a path [m^2]. Runs a parallel loop in the current TBB arena, as all below.
double pathEnergy(const GhostSpace& space, double bending, const PathCoordinates& path);

/// The path at `share` of its way, in [0, 1]: a frame of it, or the average of the two around that place.
Solved<Eigen::VectorXd> pointOf(const GhostSpace& space, double bending, const PathCoordinates& path, double share,
                                const ReducedPathOptions& options);

/// As many frames as wanted at even steps along a path, by pointOf(); the blend of the coordinates where an average was
/// not found.
PathCoordinates resampled(const GhostSpace& space, double bending, const PathCoordinates& path, std::size_t frames,
                          const ReducedPathOptions& options);

/// The path with zeros for the coordinates along directions that the space has gained since.
PathCoordinates extended(const PathCoordinates& path, const GhostSpace& space);

}  // namespace shaped
