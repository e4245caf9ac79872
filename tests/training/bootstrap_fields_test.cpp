#include <catch2/catch.hpp>

#include "core/training/field_training.h"
#include "tests/support/bootstraps.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// Trains a small network with LibTorch.
FieldTrainer networkTrainer(std::vector<FieldLoss>& last_losses, int epochs) {
  return [&last_losses, epochs](const FieldTrainingSet& set,
                                const std::stop_token& stop) -> std::optional<JacobianFieldWeights> {
    std::vector<FieldPair> pairs;
    for (const auto& pair : set.pairs)
      pairs.push_back(makeFieldPair(set.reference, pair.source, pair.target, pair.scan, set.scaling));
    FieldArchitecture architecture{{12}, {12}, {24}, true};
    FieldTrainingOptions options;
    options.epochs = epochs;
    options.batch = 1;
    options.warm_up = 5;
    options.stop = stop;
    options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState&) {
      if (epoch.epoch == 1 || epoch.epoch == epochs) last_losses.push_back(epoch.loss);
    };
    auto trained = trainJacobianField(pairs, untrainedState(untrainedField(set.scaling, architecture, 1)), options);
    if (trained.termination == Termination::kCancelled) return std::nullopt;
    return std::move(trained.solution.weights);
  };
}

}  // namespace

TEST_CASE("a bootstrap with trained networks grows, and gives the same bits again from its scans on") {
  auto set = creatureBootstrap(5, 3, 3);
  set.options.rounds = 1;
  std::vector<FieldLoss> losses;
  std::optional<BootstrapCheckpoint> before_scans;
  BootstrapWatch watch;
  watch.checkpoint = [&](const auto& state) {
    if (auto now = state(); now.field && now.scans.size() == 1) before_scans = std::move(now);
  };
  const auto grown = bootstrapBody(set.inputs, networkTrainer(losses, 30), set.options, watch);
  REQUIRE(grown);
  CHECK(grown->joined.size() >= 1);
  CHECK(grown->field.offsets);
  REQUIRE(losses.size() == 4);  // first and last epoch of two trainings
  CHECK(losses[1].total < losses[0].total);
  CHECK(losses[3].total < losses[2].total);
  for (const auto& scan : grown->rounds[0].scans) {
    CHECK(scan.chamfer != scan.model_chamfer);
    CHECK(scan.chamfer < 1.1 * scan.model_chamfer);
  }

  REQUIRE(before_scans);
  losses.clear();
  const auto resumed = bootstrapBody(set.inputs, networkTrainer(losses, 30), set.options, {}, before_scans);
  REQUIRE(resumed);
  CHECK(losses.size() == 2);  // the first field was kept
  CHECK(resumed->joined == grown->joined);
  CHECK(resumed->model.parts().modes == grown->model.parts().modes);
  for (std::size_t layer = 0; layer < grown->field.mlp.size(); ++layer)
    CHECK(resumed->field.mlp[layer].weight == grown->field.mlp[layer].weight);
}
