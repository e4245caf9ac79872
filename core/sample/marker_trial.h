#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/markers/marker_set.h"
#include "core/markers/marker_trial.h"
#include "core/sample/creature.h"

namespace shaped {

struct SampleTrialOptions {
  int frames = 60;        ///< >= 1
  double rate_hz = 30;    ///< > 0
  double noise = 0.0025;  ///< standard deviation of each coordinate, m, >= 0
  double dropout = 0.05;  ///< share of the marker samples that are missing, 0 to 0.5; mostly in runs
  std::uint64_t seed = 1;

  std::optional<std::string> firstViolation() const;  ///< "frames = 0, want >= 1"
};

/// A recording of a creature that never was: what cameras would have seen, and the truth.
struct SampleTrial {
  MarkerSet markers;            ///< 32 labels at skin vertices
  MarkerTrial trial;            ///< noisy, NaN where not seen, in world coordinates
  std::vector<Vertices> truth;  ///< V x 3 each: the moving skin
};

/// The creature's markers: on head, back, tail and every joint of the legs, each at the skin vertex nearest to its
/// place.
MarkerSet creatureMarkers(const SampleCreature& creature);

/// Records the creature while it trots along a bend (sampleMotion). Throws InvalidInput for options out of range.
SampleTrial sampleMarkerTrial(const SampleCreature& creature, const SampleTrialOptions& options = {});

}  // namespace shaped
