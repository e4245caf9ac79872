#pragma once

#include "core/skeleton/rig.h"
#include "tests/support/shapes.h"

namespace shaped::test {

/// A tube along x (tests/support/shapes.h) with a chain of `joints` joints along its axis and two branches at its end,
/// weights that blend smoothly between neighbouring bones.
struct RiggedTube {
  Mesh mesh;
  Rig rig;
};
RiggedTube riggedTube(int joints);

/// Every joint turned by up to `angle` radians about a random axis, the root moved by up to `angle` metres.
Pose randomPose(const Skeleton& skeleton, double angle, unsigned seed);

}  // namespace shaped::test
