#include "core/model/shell_pga_checkpoint.h"

#include <catch2/catch.hpp>
#include <set>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/model/shell_pga_training.h"
#include "core/numerics/error.h"
#include "tests/support/models.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Contains;

namespace {

/// All states that a training offers.
std::vector<ShellPgaCheckpoint> statesOf(const ShellPgaTrainingSet& set, std::stop_token stop = {}) {
  std::vector<ShellPgaCheckpoint> states;
  trainShellPga(set, smallTraining(), {}, std::move(stop),
                {[&](const auto& state) { states.push_back(state()); }, nullptr});
  return states;
}

ShellPgaCheckpoint throughFile(const ShellPgaCheckpoint& state) {
  const TemporaryFolder folder;
  writeCheckpoint(folder / "c", state);
  return readCheckpoint(folder / "c");
}

}  // namespace

TEST_CASE("a training resumed from any checkpoint of its mean gives the same model") {
  const auto set = fourTubes();
  const auto whole = trainShellPga(set, smallTraining(), {}, {});
  REQUIRE(whole.converged());
  const auto states = statesOf(set);
  REQUIRE(states.size() > 4);
  CHECK_FALSE(states.front().spider);
  CHECK(states.back().mean_ended);
  for (const auto& state : states) {
    if (state.mean_ended) break;  // what follows has a test of its own
    INFO(state.stage());
    const auto read = throughFile(state);
    const auto resumed = trainShellPga(set, smallTraining(), {}, {}, {{}, &read});
    REQUIRE(resumed.converged());
    CHECK(resumed.iterations == whole.iterations);
    const auto &before = *whole.solution, &after = *resumed.solution;
    CHECK(after.parts().coarsening.kept == before.parts().coarsening.kept);
    const Eigen::ArrayXd expected = before.pga().eigenvalues.head(3), got = after.pga().eigenvalues.head(3);
    CHECK(((got - expected) / expected).abs().maxCoeff() < 1e-6);
    CHECK(rmsVertexDistance(apply(alignRigidly(after.mean(), before.mean()), after.mean()), before.mean()) < 1e-7);
  }
}

TEST_CASE("every stage after the mean is kept item by item, and resumed to the same bits") {
  const auto set = fourTubes();
  const auto whole = trainShellPga(set, smallTraining(), {}, {});
  std::set<std::string> stages;
  for (const auto& state : statesOf(set)) {
    if (!state.mean_ended) continue;
    INFO(state.stage());
    stages.insert(state.stage());
    const auto read = throughFile(state);
    const auto resumed = trainShellPga(set, smallTraining(), {}, {}, {{}, &read});
    REQUIRE(resumed.converged());
    CHECK(resumed.iterations == whole.iterations);
    CHECK(resumed.residual == whole.residual);
    CHECK(resumed.solution->pga().eigenvalues == whole.solution->pga().eigenvalues);
    CHECK(resumed.solution->pga().variations == whole.solution->pga().variations);
    CHECK(resumed.solution->mean() == whole.solution->mean());
  }
  for (const auto* stage :
       {"Frechet mean done", "Gram matrix, 1 of 4 rows", "Gram matrix, 4 of 4 rows", "reflections, 1 of 4",
        "reflections, 4 of 4", "principal variations, 1 of 2", "principal variations, 2 of 2"})
    CHECK(stages.count(stage) == 1);
}

TEST_CASE("a training that dies after every checkpoint ends with the same model, and repeats nothing that was kept") {
  const auto set = fourTubes();
  const auto whole = trainShellPga(set, smallTraining(), {}, {});
  std::optional<ShellPgaCheckpoint> kept;
  Solved<ShellPgaModelPtr> trained;
  int runs = 0;
  do {
    std::stop_source stop;
    const auto from = kept;
    const auto stage = [](const auto& state) { return state ? state->stage() : ""; };
    const auto sink = [&](const auto& state) {
      kept = throughFile(state());
      if (stage(kept) != stage(from)) stop.request_stop();
    };
    trained = trainShellPga(set, smallTraining(), {}, stop.get_token(), {sink, from ? &*from : nullptr});
    REQUIRE(++runs < 60);
    if (trained.termination == Termination::kCancelled) REQUIRE(stage(kept) != stage(from));
  } while (!trained.solution);
  CHECK(runs > 10);
  REQUIRE(trained.converged());
  const Eigen::ArrayXd expected = whole.solution->pga().eigenvalues.head(3);
  const Eigen::ArrayXd got = trained.solution->pga().eigenvalues.head(3);
  CHECK(((got - expected) / expected).abs().maxCoeff() < 1e-6);
}

TEST_CASE("a training that is stopped offers its last iterate") {
  const auto set = fourTubes();
  std::stop_source stop;
  std::vector<ShellPgaCheckpoint> states;
  const auto sink = [&](const auto& state) {
    states.push_back(state());
    if (states.back().mean.iterations == 1) stop.request_stop();
  };
  const auto stopped = trainShellPga(set, smallTraining(), {}, stop.get_token(), {sink, nullptr});
  CHECK(stopped.termination == Termination::kCancelled);
  CHECK_FALSE(states.back().mean_ended);
  const auto resumed = trainShellPga(set, smallTraining(), {}, {}, {{}, &states.back()});
  CHECK(resumed.converged());
}

TEST_CASE("a checkpoint is of one training: of these shapes and options") {
  const auto state = statesOf(fourTubes()).front();
  auto other = fourTubes();
  other.shapes[2](3, 1) += 1e-9;
  CHECK_THROWS_WITH(trainShellPga(other, smallTraining(), {}, {}, {{}, &state}), Contains("another training"));
  auto options = smallTraining();
  options.tolerance = 1e-7;
  CHECK_THROWS_WITH(trainShellPga(fourTubes(), options, {}, {}, {{}, &state}), Contains("another training"));
  CHECK(trainingFingerprint(fourTubes(), smallTraining()) == state.training);
}

TEST_CASE("a damaged checkpoint is refused wherever the damage is") {
  const TemporaryFolder folder;
  writeCheckpoint(folder / "c", statesOf(fourTubes()).back());
  const auto bytes = bytesOf(folder / "c");
  for (const std::size_t at : {std::size_t{0}, bytes.size() / 2, bytes.size() - 1, bytes.find("training") + 12}) {
    auto damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    INFO(at);
    CHECK_THROWS_AS(readCheckpoint(folder.file("damaged", damaged)), InvalidInput);
  }
  CHECK_THROWS_AS(readCheckpoint(folder.file("short", bytes.substr(0, bytes.size() - 8))), InvalidInput);
  CHECK_THROWS_AS(readCheckpoint(folder.file("empty", "")), InvalidInput);
  CHECK_THROWS_AS(readCheckpoint(folder / "none"), InvalidInput);
}
