#include "core/sample/motion.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numbers>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/core/sample/sample_fixture.h"

using namespace shaped;

namespace {

/// Rotation that the skin's weights give a face, not orthonormal: enough to carry its normal along.
Eigen::Matrix3d blendedRotation(const SampleCreature& creature, const std::vector<BoneMotion>& motions,
                                Eigen::Index f) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int c = 0; c < 3; ++c)
    for (std::size_t b = 0; b < motions.size(); ++b)
      sum += creature.weights(creature.topology->faces()(f, c), Eigen::Index(b)) * motions[b].rotation;
  return sum;
}

}  // namespace

TEST_CASE("the rest pose is the rest shape, and the root moves the whole body rigidly") {
  const auto& creature = defaultCreature();
  auto moved = restPose(creature);
  CHECK(pose(creature, moved).isApprox(creature.rest, 1e-14));
  moved.root << 1, 2, 3;
  moved.rotations[0] << 0, std::numbers::pi / 2, 0;
  const Vertices shape = pose(creature, moved);
  const Eigen::RowVector3d joint = creature.bones[0].joint.transpose();
  // A quarter turn around y carries (x, y, z) to (z, y, -x).
  for (Eigen::Index v = 0; v < shape.rows(); v += 50) {
    const Eigen::RowVector3d offset = creature.rest.row(v) - joint;
    const Eigen::RowVector3d want =
        joint + Eigen::RowVector3d(1, 2, 3) + Eigen::RowVector3d(offset.z(), offset.y(), -offset.x());
    CHECK((shape.row(v) - want).norm() < 1e-12);
  }
}

TEST_CASE("turning one bone moves its limb and leaves the others") {
  const auto& creature = defaultCreature();
  auto raised = restPose(creature);
  raised.rotations[std::size_t(boneIndex(creature.bones, "upper_arm_left"))] << -0.8, 0, 0;
  const Vertices shape = pose(creature, raised);
  const auto moved = (shape - creature.rest).rowwise().norm().eval();
  const Eigen::VectorXd paw = creature.weights.col(boneIndex(creature.bones, "paw_left"));
  const Eigen::VectorXd muzzle = creature.weights.col(boneIndex(creature.bones, "muzzle"));
  Eigen::Index in_paw, in_muzzle;
  paw.maxCoeff(&in_paw), muzzle.maxCoeff(&in_muzzle);
  CHECK(moved[in_paw] > 0.15);
  CHECK(shape(in_paw, 2) > creature.rest(in_paw, 2) + 0.1);  // forwards
  CHECK(moved[in_muzzle] < 0.005);
}

TEST_CASE("a pose needs one rotation for each bone") {
  CreaturePose short_pose = restPose(defaultCreature());
  short_pose.rotations.pop_back();
  CHECK_THROWS_WITH(pose(defaultCreature(), short_pose), Catch::Contains("pose.rotations"));
  CHECK_THROWS_AS(boneIndex(defaultCreature().bones, "wing"), InvalidInput);
  CHECK_THROWS_AS(samplePoses(defaultCreature(), -1, 0), InvalidInput);
}

TEST_CASE("no triangle of a sampled pose collapses, of any body") {
  const auto& creature = defaultCreature();
  for (std::uint64_t body = 0; body < 4; ++body) {
    const auto individual = body == 0 ? creature : withProportions(creature, randomProportions(body));
    for (const auto& shape : samplePoses(individual, 40, body)) {
      CHECK(shape.allFinite());
      CHECK(smallestAreaRatio(creature.topology->faces(), individual.rest, shape) > 0.05);
    }
  }
}

TEST_CASE("no triangle of a random pose turns against its skin") {
  const auto& creature = defaultCreature();
  const Vertices rest_normals = faceNormals(creature.topology->faces(), creature.rest);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const auto posed = randomPose(creature, seed);
    const auto motions = boneMotions(creature, posed);
    const Vertices normals = faceNormals(creature.topology->faces(), pose(creature, posed));
    for (Eigen::Index f = 0; f < normals.rows(); ++f) {
      const Eigen::Vector3d carried = blendedRotation(creature, motions, f) * rest_normals.row(f).transpose();
      if (normals.row(f).dot(carried) <= 0) FAIL_CHECK("seed " << seed << ", face " << f);
    }
  }
}

TEST_CASE("sampled poses stand on the ground, differ, and depend on the seed alone") {
  const auto& creature = defaultCreature();
  const auto shapes = samplePoses(creature, 6, 5), again = samplePoses(creature, 6, 5),
             other = samplePoses(creature, 6, 6);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    CHECK(std::abs(shapes[i].col(1).minCoeff()) < 1e-12);
    CHECK(shapes[i] == again[i]);
    CHECK(meanVertexDistance(shapes[i], other[i]) > 0.01);
    if (i > 0) CHECK(meanVertexDistance(shapes[i], shapes[i - 1]) > 0.02);
  }
  CHECK(samplePoses(creature, 3, 5)[2] == shapes[2]);  // more poses keep the earlier ones
}

TEST_CASE("a trot repeats after a stride and mirrors after half of it") {
  const auto& creature = defaultCreature();
  const Vertices start = pose(creature, trot(creature, 0.4, 1)),
                 next = pose(creature, trot(creature, 0.4 + 2 * std::numbers::pi, 1));
  CHECK(meanVertexDistance(start, next) < 1e-12);
  const auto half = trot(creature, 0.4 + std::numbers::pi, 1), now = trot(creature, 0.4, 1);
  const auto left = std::size_t(boneIndex(creature.bones, "thigh_left")),
             right = std::size_t(boneIndex(creature.bones, "thigh_right"));
  CHECK(half.rotations[left].x() == Approx(now.rotations[right].x()));
  CHECK(now.rotations[left].x() != Approx(now.rotations[right].x()));
  CHECK(pose(creature, trot(creature, 1.0, 0)).isApprox(creature.rest, 1e-12));
}

TEST_CASE("a sampled motion travels, smoothly") {
  const auto& creature = defaultCreature();
  const auto motion = sampleMotion(creature, 60, 30, 1);
  REQUIRE(motion.size() == 60);
  CHECK((motion.back().root - motion.front().root).norm() > 0.8);
  Vertices last = pose(creature, motion[0]);
  for (std::size_t frame = 1; frame < motion.size(); ++frame) {
    const Vertices shape = pose(creature, motion[frame]);
    CHECK(maxVertexDistance(shape, last) < 0.15);  // 4.5 m/s at 30 frames a second
    CHECK(meanVertexDistance(shape, last) > 0.01);
    last = shape;
  }
}
