#include "core/clothing/limb_poses.h"

#include <catch2/catch.hpp>

#include "tests/support/rigs.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// An arm: upper arm, forearm, hand with a finger of two bones and a thumb; and a head beside it.
const Skeleton kArm({{"trunk", -1},
                     {"arm", 0},
                     {"forearm", 1},
                     {"hand", 2},
                     {"finger", 3},
                     {"fingertip", 4},
                     {"thumb", 3},
                     {"head", 0}});
constexpr std::int32_t kForearm = 2, kHead = 7;
constexpr Limb kLimb{1, kForearm};

}  // namespace

TEST_CASE("a limb's other ways are its lower part at rest, untwisted, and as others hold it") {
  const Pose pose = randomPose(kArm, 0.5, 2), other = randomPose(kArm, 0.5, 3);
  Vertices joints = Vertices::Zero(8, 3);
  joints.col(0) << 0, 0.2, 0.5, 0.8, 0.9, 0.95, 0.85, 0;
  const auto poses = otherLimbPoses(kArm, joints, kLimb, pose, {&other, 1});
  REQUIRE(poses.size() == 3);
  for (const auto* straight : {&poses[0], &poses[1]}) {
    CHECK(straight->rotations.middleRows<5>(kForearm).isZero(0));
    CHECK(straight->rotations.row(kHead) == pose.rotations.row(kHead));
  }
  CHECK(poses[0].rotations.row(1) == pose.rotations.row(1));
  // Without twist: the turn's axis stands square to the bone, which goes where it went.
  CHECK(std::abs(poses[1].rotations(1, 0)) < 1e-9);
  CHECK(poses[2].rotations.middleRows<6>(1) == other.rotations.middleRows<6>(1));
  CHECK(poses[2].rotations.row(kHead) == pose.rotations.row(kHead));
}
