#pragma once

#include <stop_token>

#include "core/curve/curve.h"

namespace shaped {

/// Which way each frame of a curve, but the ends of an open one, would go to lower the path energy (4): Newton's
/// direction of its own coordinates at full resolution, without its rigid part; [BvTH16] (9) with the Hessian where the
/// frame is instead of where its neighbours would be on it; with elements that are not indefinite where the Hessian itself
/// is not positive definite.
struct FlowTangents {
  std::vector<Eigen::VectorXd> directions;  ///< 3V each; empty at the ends and where there is none
  /// Where the inner frames would be after a step of Newton's method for all of them, if the Hessian were the same
  /// along the curve: y_i - (y_i-1 + y_i+1) / 2 = directions_i. Empty for a closed curve and when a direction is
  /// missing.
  std::vector<Eigen::VectorXd> displacements;
  /// The largest over the frames of |gradient| / (|force towards the one before| + |towards the next|): 0 for a
  /// geodesic.
  double residual = 0;
};

/// Of each curve. It may be anywhere, but its frames must be aligned to each other. Stopped: some directions are
/// missing. Runs a parallel loop over all frames in the current TBB arena, with a factorisation for each.
std::vector<FlowTangents> flowTangents(const ShellStructurePtr& structure, double bending,
                                       const std::vector<Curve>& curves, const std::stop_token& stop = {});

}  // namespace shaped
