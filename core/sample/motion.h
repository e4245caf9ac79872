#pragma once

#include <cstdint>
#include <vector>

#include "core/sample/skinning.h"

namespace shaped {

/// A trot: diagonal legs swing together, the back bends, the head nods and the tail sways.
/// phase: radians of the stride; stride: 0 stands still, 1 is a full trot. Within the joints' limits.
CreaturePose trot(const SampleCreature& creature, double phase, double stride);

/// A natural pose at random: a moment of a stride mixed with sitting, bowing, sniffing, leaping or looking around, and
/// every joint a little its own way, kept within its limits.
CreaturePose randomPose(const SampleCreature& creature, std::uint64_t seed);

/// n natural poses, standing on y = 0; seed and index decide each. Rotations are reduced where skinning would squeeze a
/// triangle below a tenth of its area at rest. Throws InvalidInput when n < 0.
std::vector<Vertices> samplePoses(const SampleCreature& creature, int n, std::uint64_t seed);

/// Moves about for `frames` frames at `rate_hz`: trots along a bend of about a metre's radius, looks around, crouches.
std::vector<CreaturePose> sampleMotion(const SampleCreature& creature, int frames, double rate_hz, std::uint64_t seed);

}  // namespace shaped
