#pragma once

#include "core/geodesic/geodesic.h"
#include "core/mesh/anchor.h"

namespace shaped {

/// A point carried by the surface and where it is wanted.
struct AnchorTarget {
  Anchor anchor;
  Eigen::Vector3d position;  ///< [m]
  double weight = 1;         ///< >= 0, of the squared distance
};

struct AnchoredFitOptions {
  double prior_weight = 1;   ///< gamma of (22), > 0
  int max_iterations = 60;   ///< Newton steps, >= 1
  double tolerance = 1e-6;   ///< relative gradient norm, > 0
  std::stop_token stop;
};

/// The shape s near `start` that minimises
///   sum_l w_l |X_l(s) - x_l|^2 + gamma W[s, prior],
/// the model fitting energy (22) of [HZRS18] for a fixed projection `prior`; the free shape is W's first argument. The
/// targets place the shape in space: at least three with positive weight, not on one line.
Solved<Vertices> fitAnchored(const GeodesicCalculus& calculus, const Vertices& prior,
                             const std::vector<AnchorTarget>& targets, const Vertices& start,
                             const AnchoredFitOptions& options);

/// True when the positions of the targets with positive weight span a plane, so that they determine a rigid motion.
bool determinePlacement(const std::vector<AnchorTarget>& targets);

/// Positions of the anchors on a shape, L x 3.
Vertices anchorPositions(const Topology& topology, const std::vector<AnchorTarget>& targets, const Vertices& shape);

}  // namespace shaped
