#pragma once

#include "core/geodesic/geodesic.h"
#include "core/numerics/progress.h"

namespace shaped {

/// The polygonal spider of [HZRS18] Fig. 4.
struct Spider {
  Vertices mean;
  std::vector<Path> arms;  ///< per input shape K + 1 shapes, from the mean to the input
};

struct FrechetMeanOptions {
  int path_steps = 4;       ///< K of each arm, >= 1
  int max_iterations = 100; ///< joint Newton steps, >= 1
  double tolerance = 1e-8;  ///< on the largest relative force imbalance of any shape, > 0
  std::stop_token stop;
  ProgressSink progress;
  const Spider* start = nullptr;  ///< of similar shapes in the same order with as many steps; null: start anew
  /// Sees every iterate of the Newton method, and the last one again when the stop token has fired; may be empty.
  /// Started from an iterate, the method goes on as if it had not been interrupted. iterate(): makes the spider.
  std::function<void(const Outcome& so_far, const std::function<Spider()>& iterate)> on_iterate = {};
};

/// The discrete Frechet mean (10) with its geodesics to the inputs, relaxed together: every inner shape of every arm and
/// the mean are unknowns of one Newton method.
///
/// As in the Euler-Lagrange equation (25) the mean is the deformed shape of the segments that meet in it: arm i runs
/// from input i to the mean, E = (1/n) sum_i K sum_k W. The residual covers (23) on all arms and (25).
/// Started from the mean lengths and angles and the elastic average (K = 1). Throws InvalidInput naming shapes[i] when
/// there are none or one does not fit the topology. Runs parallel loops in the current TBB arena.
Solved<Spider> frechetMean(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes,
                           const FrechetMeanOptions& options);

}  // namespace shaped
