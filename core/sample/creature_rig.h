#pragma once

#include "core/sample/creature.h"
#include "core/skeleton/rig.h"

namespace shaped {

/// The creature's bones as a rig of its mesh at rest: a joint a bone, of its name, without limits.
Rig rigOf(const SampleCreature& creature);

}  // namespace shaped
