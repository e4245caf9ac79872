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

TEST_CASE("left and right are exchanged as a mirror would have them, branch by branch") {
  const Skeleton skeleton({{"hips", -1},
                           {"left hip", 0},
                           {"left leg", 1},
                           {"left shin", 2},
                           {"right hip", 0},
                           {"right leg", 4},
                           {"right shin", 5},
                           {"tail", 0},
                           {"tip", 7}});
  Vertices joints = Vertices::Zero(9, 3);
  joints.col(0) << 0, 0.05, 0.1, 0.12, -0.05, -0.1, -0.12, 0, 0;
  joints.col(1) << 1, 0.95, 0.9, 0.5, 0.95, 0.9, 0.5, 1, 1.1;
  joints.col(2) << 0, 0, 0, 0.02, 0, 0, 0.02, -0.3, -0.6;
  const std::vector<Limb> limbs = {{2, 3}, {5, 6}, {7, 8}};
  Pose pose = randomPose(skeleton, 0.8, 4);
  pose.rotations.row(0).setZero();
  const auto poses = exchangedLimbs(skeleton, joints, limbs, pose);
  REQUIRE(poses.size() == 1);  // the tail has no twin
  CHECK(poses[0].rotations.bottomRows<2>() == pose.rotations.bottomRows<2>());
  const Vertices before = poseSkeleton(skeleton, joints, {Eigen::Vector3d::Zero(), pose.rotations}).joints;
  const Vertices after = poseSkeleton(skeleton, joints, {Eigen::Vector3d::Zero(), poses[0].rotations}).joints;
  for (const auto& [left, right] : {std::pair{2, 5}, {3, 6}}) {
    CHECK((after.row(left) - before.row(right).cwiseProduct(Eigen::RowVector3d(-1, 1, 1))).norm() < 1e-12);
    CHECK((after.row(right) - before.row(left).cwiseProduct(Eigen::RowVector3d(-1, 1, 1))).norm() < 1e-12);
  }
  // Twice is as before; legs of different lengths are no pair.
  CHECK(exchangedLimbs(skeleton, joints, limbs, poses[0])[0].rotations.isApprox(pose.rotations));
  joints.row(6) *= 0.5;
  CHECK(exchangedLimbs(skeleton, joints, limbs, pose).empty());
}
