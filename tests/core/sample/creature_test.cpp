#include "core/sample/creature.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/sample/implicit_body.h"
#include "core/sample/random.h"
#include "tests/core/sample/sample_fixture.h"

using namespace shaped;

namespace {

double height(const SampleCreature& creature) {
  return creature.rest.col(1).maxCoeff() - creature.rest.col(1).minCoeff();
}
double length(const SampleCreature& creature) {
  return creature.rest.col(2).maxCoeff() - creature.rest.col(2).minCoeff();
}

Eigen::Vector3d randomPoint(Random& random, double half_width) {
  return {random.uniform(-half_width, half_width), random.uniform(-half_width, half_width),
          random.uniform(-half_width, half_width)};
}

}  // namespace

TEST_CASE("the creature is one closed surface of genus 0 with even triangles and the asked number of vertices") {
  const auto& creature = defaultCreature();
  CHECK(creature.topology->vertexCount() == Approx(1500).epsilon(0.1));
  CHECK(creature.topology->closed());
  CHECK(creature.topology->componentCount() == 1);
  CHECK(eulerNumber(*creature.topology) == 2);
  const auto qualities = triangleQualities(creature.topology->faces(), creature.rest);
  CHECK(qualities.minCoeff() > 0.6);
  CHECK(qualities.mean() > 0.95);
}

TEST_CASE("the creature is about a metre long, stands on the ground and lies on its implicit surface") {
  const auto& creature = defaultCreature();
  CHECK(length(creature) == Approx(1).epsilon(0.15));
  CHECK(std::abs(creature.rest.col(1).minCoeff()) < 0.012);
  const ImplicitBody body(creature.bones);
  for (Eigen::Index v = 0; v < creature.rest.rows(); ++v)
    CHECK(std::abs(body.value(creature.rest.row(v).transpose())) < 1e-6);
}

TEST_CASE("the same options give the same creature, other counts another one") {
  CreatureOptions options;
  options.vertices = 700;
  const auto one = makeCreature(options), two = makeCreature(options);
  CHECK(one.topology->id() == two.topology->id());
  CHECK(one.rest == two.rest);
  CHECK(one.weights == two.weights);
  CHECK(one.topology->vertexCount() == Approx(700).epsilon(0.1));
  CHECK(triangleQualities(one.topology->faces(), one.rest).minCoeff() > 0.5);
}

TEST_CASE("skin weights are smooth shares that follow the nearest bone") {
  const auto& creature = defaultCreature();
  CHECK(creature.weights.minCoeff() >= 0);
  CHECK((creature.weights.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-12);
  double steepest = 0;
  for (const auto& edge : creature.topology->edges())
    steepest =
        std::max(steepest, (creature.weights.row(edge[0]) - creature.weights.row(edge[1])).cwiseAbs().maxCoeff());
  CHECK(steepest < 0.45);
  Eigen::Index nose, owner;
  creature.rest.col(2).maxCoeff(&nose);
  creature.weights.row(nose).maxCoeff(&owner);
  CHECK(creature.bones[std::size_t(owner)].name == "muzzle");
}

TEST_CASE("proportions change the body, not the connectivity") {
  const auto& creature = defaultCreature();
  Proportions tall;
  tall.leg_length = 1.3;
  const auto longer_legs = withProportions(creature, tall);
  CHECK(longer_legs.topology == creature.topology);
  CHECK(height(longer_legs) > height(creature) + 0.05);
  CHECK(length(longer_legs) == Approx(length(creature)).epsilon(0.02));
  Proportions bushy;
  bushy.tail_length = 1.4;
  CHECK(length(withProportions(creature, bushy)) > length(creature) + 0.05);
  CHECK(withProportions(creature, {}).rest.isApprox(creature.rest, 1e-6));
}

TEST_CASE("bodies at random keep sound triangles on their own surface") {
  const auto& creature = defaultCreature();
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const auto body = withProportions(creature, randomProportions(seed));
    CHECK(triangleQualities(body.topology->faces(), body.rest).minCoeff() > 0.15);
    CHECK(smallestAreaRatio(body.topology->faces(), creature.rest, body.rest) > 0.1);
    CHECK(meanVertexDistance(body.rest, creature.rest) > 0.005);
  }
  CHECK(randomProportions(3).leg_length == randomProportions(3).leg_length);
  CHECK(randomProportions(3).leg_length != randomProportions(4).leg_length);
}

TEST_CASE("options out of range are refused by name") {
  CreatureOptions options;
  options.vertices = 10;
  CHECK_THROWS_WITH(makeCreature(options), Catch::Contains("vertices = 10, want 600 to 20000"));
  options = {};
  options.proportions.leg_length = 3;
  CHECK_THROWS_WITH(makeCreature(options), Catch::Contains("proportions.leg_length"));
  Proportions none;
  none.ear_length = std::nan("");
  CHECK_THROWS_AS(makeSkeleton(none), InvalidInput);
}

TEST_CASE("the distance to a bone is that to the nearest of its spheres") {
  const Bone bone{"", -1, Limb::kTrunk, {0.1, 0, 0}, {0.3, 0.2, 0.1}, 0.08, 0.02};
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d point = randomPoint(random, 0.5);
    double nearest = 1e9;
    for (int i = 0; i <= 4000; ++i) {
      const double t = i / 4000.0;
      nearest = std::min(nearest, (point - bone.joint - t * (bone.end - bone.joint)).norm() - (0.08 - 0.06 * t));
    }
    CHECK(distanceToBone(bone, point) == Approx(nearest).margin(1e-4));
  }
}

TEST_CASE("the implicit body's gradient is that of central differences") {
  const ImplicitBody body(makeSkeleton({}));
  Random random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d point = body.project(Eigen::Vector3d(0, 0.4, 0) + randomPoint(random, 0.3));
    Eigen::Vector3d differences;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(axis);
      differences[axis] = (body.value(point + step) - body.value(point - step)) / 2e-6;
    }
    CHECK((body.level(point).gradient - differences).norm() < 1e-4);
  }
}
