#pragma once

#include "core/sample/creature.h"

namespace shaped {

/// The default creature, made once for all tests.
inline const SampleCreature& defaultCreature() {
  static const SampleCreature creature = makeCreature();
  return creature;
}

/// Vertices - edges + faces: 2 for a sphere, 0 for a torus.
inline int eulerNumber(const Topology& topology) {
  return topology.vertexCount() - static_cast<int>(topology.edges().size()) + static_cast<int>(topology.faces().rows());
}

}  // namespace shaped
