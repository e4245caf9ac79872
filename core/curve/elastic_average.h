#pragma once

#include <vector>

#include "core/numerics/newton.h"
#include "core/shell/pair_energy.h"
#include "core/shell/structure.h"

namespace shaped {

/// A shape that counts for so much in an average.
struct AverageTerm {
  const ShellMeasures* measures;  ///< lives as long as the call
  double weight;                  ///< >= 0; only the weights' ratios matter
};

/// Draws a shape's points to others: adds weight * sum_v |y_v - points_v|^2 to what is minimised [m^2].
struct PointPull {
  const Vertices* points = nullptr;  ///< V x 3; lives as long as the call
  double weight = 0;                 ///< >= 0; its ratio to the shapes' weights matters
};

/// The elastic average of shapes, argmin over y of sum_i w_i (W[s_i, y] + W[y, s_i]), [BvTH16] (1), or of sum_i w_i
/// W[s_i, y] alone, (10), where the energy is directed. Neither changes when a shape moves rigidly.
///
/// start: V x 3, near the average; the answer stays where six of its coordinates are (gaugePins), or goes where the
/// pull wants it. The topology must have one component. Throws InvalidInput naming "weights" when there is no positive
/// one, or one is negative or not finite.
Solved<Vertices> elasticAverage(const ShellStructurePtr& structure, const PairEnergy& energy,
                                const std::vector<AverageTerm>& terms, const Vertices& start,
                                const NewtonOptions& options, const PointPull& pull = {});

}  // namespace shaped
