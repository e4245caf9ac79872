#include "core/sample/creature_rig.h"

#include <catch2/catch.hpp>

#include "core/mesh/quality.h"
#include "core/sample/skinning.h"
#include "core/skeleton/skinning.h"
#include "tests/core/sample/sample_fixture.h"

using namespace shaped;

TEST_CASE("a creature's rig poses its mesh as the creature itself is posed") {
  const auto creature = makeCreature({.vertices = 800, .proportions = {}});
  const auto rig = rigOf(creature);
  rig.requireValid(creature.topology->vertexCount());
  auto own = restPose(creature);
  Pose other = restPose(rig.skeleton);
  own.root = Eigen::Vector3d(0.1, 0.2, -0.1);
  other.translation = own.root;
  for (std::size_t b = 0; b < own.rotations.size(); ++b) {
    own.rotations[b] =
        0.4 * Eigen::Vector3d(std::sin(3.0 * double(b)), std::cos(5.0 * double(b)), std::sin(7.0 * double(b)));
    other.rotations.row(Eigen::Index(b)) = own.rotations[b];
  }
  // Shares below 1e-4 are left out of the rig.
  CHECK(maxVertexDistance(skinned(rig, creature.rest, other), pose(creature, own)) < 3e-4);
  CHECK(rig.skeleton.jointCount() == std::ssize(creature.bones));
}
