#include "core/bootstrap/field_judgement.h"

#include <catch2/catch.hpp>

#include "tests/support/bootstraps.h"
#include "tests/support/fields.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::vector<RestPair> pairsOf(const std::vector<std::size_t>& examples) {
  std::vector<RestPair> pairs;
  for (const auto example : examples) pairs.push_back({{}, {}, {}, example});
  return pairs;
}

/// Bodies that are all to grow by a tenth: what a constant field can say.
FieldTrainingSet growing(const CreatureBootstrap& set) {
  const auto& [topology, rest, rig, regressor] = set.inputs.reference;
  FieldTrainingSet training;
  training.reference = std::make_shared<const FieldReference>(*makeFieldReference(topology, rest));
  training.scaling = scalingOf(*training.reference);
  const auto& poisson = *training.reference->poisson;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& source = set.inputs.registrations[i];
    const Vertices target = poisson.solve(poisson.jacobians(source) * 1.1, poisson.centroids(source));
    training.pairs.push_back({source, target, scanOf(set, source, i + 1), i});
  }
  return training;
}

}  // namespace

TEST_CASE("every fifth of ten registrations or more judges, with all its scans") {
  auto few = pairsOf({0, 1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(takeJudges(few).empty());
  CHECK(few.size() == 9);
  auto many = pairsOf({0, 0, 1, 2, 3, 4, 4, 6, 7, 8, 9, 11, 11, 12});
  const auto judges = takeJudges(many);
  REQUIRE(judges.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(judges[i].example == (i < 2 ? 4 : 11));
  CHECK(many.size() == 10);
}

TEST_CASE("a field is judged by how near it brings bodies to what they are, and a silenced one leaves them") {
  const auto set = creatureBootstrap(2, 1, 1);
  const auto training = growing(set);
  const Eigen::Matrix3d tenth = 0.1 * Eigen::Matrix3d::Identity();
  const auto right = judgeField(training, constantField(training.scaling, tenth), training.pairs);
  CHECK(right.before > 0.01);
  CHECK(right.helps());
  CHECK(right.after < 0.5 * right.before);
  const auto wrong = judgeField(training, constantField(training.scaling, -tenth), training.pairs);
  CHECK_FALSE(wrong.helps());
  const auto silent = judgeField(training, silenced(constantField(training.scaling, tenth)), training.pairs);
  CHECK(silent.after == Approx(silent.before).epsilon(1e-9));
  CHECK(FieldJudgement{0.005, 0.0049}.helps());
  CHECK_FALSE(FieldJudgement{0.005, 0.00499}.helps());
  auto overflowing = constantField(training.scaling, tenth);
  overflowing.mlp.back().bias.setConstant(3e38F);
  overflowing.mlp.back().weight.setConstant(3e38F);
  overflowing.mlp.front().bias.setConstant(3e38F);
  CHECK_FALSE(judgeField(training, overflowing, training.pairs).helps());
}
