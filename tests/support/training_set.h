#pragma once

#include "core/statistics/frechet_mean.h"
#include "tests/support/calculus.h"

namespace shaped::test {

/// Shapes over one topology, with the geodesic calculus on them.
struct TrainingSet {
  Mesh mesh;
  std::shared_ptr<const GeodesicCalculus> calculus;
  std::vector<Vertices> shapes;

  /// The converged Frechet mean with K steps an arm; fails the test where it does not converge.
  Spider spider(int steps) const;
};

/// Five tubes, bent by -1 to 2.4 radians, thicker and thinner, longer and shorter, slightly irregular, each somewhere
/// else in space: four well separated eigenvalues.
TrainingSet variedTubes();

/// Five tubes that differ by their bend alone, -1 to 2.4 radians.
TrainingSet bentTubes();

}  // namespace shaped::test
