#include "core/bootstrap/bootstrap.h"

#include <oneapi/tbb/global_control.h>

#include <catch2/catch.hpp>
#include <set>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/surface_samples.h"
#include "tests/support/bootstraps.h"
#include "tests/support/fields.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;
using Catch::Contains;

namespace {

/// Everything in a result that a later process can see, bit for bit.
void checkSame(const Bootstrapped& one, const Bootstrapped& other) {
  CHECK(one.model.parts().mean == other.model.parts().mean);
  CHECK(one.model.parts().modes == other.model.parts().modes);
  CHECK(one.model.parts().deviations == other.model.parts().deviations);
  CHECK(one.variances == other.variances);
  CHECK(one.field.mlp[0].weight == other.field.mlp[0].weight);
  CHECK(one.field.scaling.signature_mean == other.field.scaling.signature_mean);
  CHECK(one.joined == other.joined);
  CHECK(one.end == other.end);
  REQUIRE(one.rounds.size() == other.rounds.size());
  for (std::size_t r = 0; r < one.rounds.size(); ++r) {
    CHECK(one.rounds[r].accepted_below == other.rounds[r].accepted_below);
    CHECK(one.rounds[r].examples == other.rounds[r].examples);
    REQUIRE(one.rounds[r].scans.size() == other.rounds[r].scans.size());
    for (std::size_t s = 0; s < one.rounds[r].scans.size(); ++s) {
      const auto &a = one.rounds[r].scans[s], &b = other.rounds[r].scans[s];
      CHECK(std::tie(a.scan, a.name, a.chamfer, a.model_chamfer, a.score, a.verdict, a.why, a.outcome.residual) ==
            std::tie(b.scan, b.name, b.chamfer, b.model_chamfer, b.score, b.verdict, b.why, b.outcome.residual));
    }
  }
}

BootstrapCheckpoint throughFile(const BootstrapCheckpoint& state) {
  const TemporaryFolder folder;
  writeBootstrapCheckpoint(folder / "c", state);
  return readBootstrapCheckpoint(folder / "c");
}

/// The set that most tests share, and what becomes of it without interruption.
const CreatureBootstrap& sharedSet() {
  static const auto set = creatureBootstrap(4, 2, 4);
  return set;
}

struct Watched {
  std::optional<Bootstrapped> grown;
  std::vector<BootstrapCheckpoint> states;
  std::vector<Progress> progress;
  std::vector<BootstrapScan> scans;
  std::vector<BootstrapRound> rounds;
};

Watched watchedRun(const CreatureBootstrap& set) {
  Watched seen;
  BootstrapWatch watch;
  watch.checkpoint = [&](const auto& state) { seen.states.push_back(state()); };
  watch.progress = [&](const Progress& progress) { seen.progress.push_back(progress); };
  watch.each_scan = [&](const BootstrapScan& scan) { seen.scans.push_back(scan); };
  watch.each_round = [&](const BootstrapRound& round) { seen.rounds.push_back(round); };
  seen.grown = bootstrapBody(set.inputs, trainPullField, set.options, watch);
  return seen;
}

const Watched& sharedRun() {
  static const auto run = watchedRun(sharedSet());
  return run;
}

}  // namespace

TEST_CASE("a bootstrap grows its model by the scans that its registrations lie nearest to") {
  const auto& set = sharedSet();
  const auto& [grown, states, progress, scans, rounds] = sharedRun();
  REQUIRE(grown);
  REQUIRE(grown->rounds.size() == rounds.size());
  CHECK(grown->end == (rounds.size() == 2 ? BootstrapEnd::kRoundsDone : BootstrapEnd::kNoneLeft));
  std::size_t registrations = set.inputs.registrations.size(), tried = 0;
  std::set<std::size_t> joined;
  for (const auto& round : rounds) {
    CHECK(round.registrations == registrations);
    CHECK(round.examples == (round.round == 1 ? 2 : registrations));
    CHECK(round.joined >= 1);
    CHECK(round.scans.size() == set.inputs.scans.count - joined.size());
    for (const auto& scan : round.scans) {
      CHECK((scan.verdict == ScanVerdict::kJoined) == (scan.chamfer <= round.accepted_below));
      CHECK(scan.chamfer < 1.1 * scan.model_chamfer);  // two examples teach the field little
      CHECK(scan.score > 0.9);
      if (scan.verdict == ScanVerdict::kJoined) CHECK(joined.insert(scan.scan).second);
    }
    registrations += round.joined + (round.round == 1 ? 2 : 0);  // from then on the field's serve the model too
    tried += round.scans.size();
  }
  CHECK(scans.size() == tried);
  for (const auto& scan : scans) CHECK(scan.verdict == ScanVerdict::kPending);
  REQUIRE(grown->joined.size() == joined.size());
  CHECK(grown->variances.size() >= std::ssize(set.inputs.registrations) - 1 + 2 + std::ssize(joined));
  CHECK(grown->model.modeCount() == 3);

  CHECK(progress.front().fraction == 0);
  for (std::size_t i = 1; i < progress.size(); ++i) CHECK(progress[i].fraction >= progress[i - 1].fraction);
  CHECK(progress.back().fraction < 1);
  CHECK_THAT(progress[1].stage, Contains("round 1 of 2") && Contains("of 2"));
  CHECK_THAT(progress.back().stage, Contains("last model"));
}

TEST_CASE("what joins is the surface at rest, and posed lies on the body that was scanned") {
  const auto& set = sharedSet();
  const auto& faces = set.inputs.reference.topology->faces();
  // The first round by hand: its model and its field, which the checkpoint after the training has.
  BodyTrainingOptions training;
  training.modes = set.options.modes;
  const auto model = trainBody(set.inputs.reference, set.inputs.registrations, training)->model;
  const auto& states = sharedRun().states;
  const auto trained = std::find_if(states.begin(), states.end(), [](const auto& state) { return state.field; });
  REQUIRE(trained != states.end());
  auto registration = set.options.registration;
  registration.field = FieldDeformation::make(model, *trained->field);
  std::size_t at = 0;
  for (const auto& scan : sharedRun().rounds.front().scans) {
    if (scan.verdict != ScanVerdict::kJoined) continue;
    INFO(scan.name);
    const auto registered = registerScan(set.inputs.scans.load(scan.scan), model, {}, registration).solution;
    REQUIRE(registered.field);
    CHECK(sharedRun().grown->joined.at(at++) == registered.field->rest);
    // Of a creature one metre long and a model of three modes.
    CHECK(distancesToSurface(registered.vertices, set.truths[scan.scan], faces).mean() < 3.5e-3);
  }
  CHECK(at == sharedRun().rounds.front().joined);
}

TEST_CASE("registrations of model and field stay apart in the first round, and to the end where they are not shared") {
  auto set = sharedSet();
  set.options.share_registrations = false;
  std::vector<std::size_t> taught;
  const FieldTrainer counting = [&](const FieldTrainingSet& training, const std::stop_token& stop) {
    taught.push_back(training.pairs.size());
    return trainPullField(training, stop);
  };
  const auto apart = bootstrapBody(set.inputs, counting, set.options);
  REQUIRE(apart);
  CHECK(taught == std::vector<std::size_t>(apart->rounds.size() + 1, 2));
  const auto& shared = *sharedRun().grown;
  CHECK(apart->rounds[0].accepted_below == shared.rounds[0].accepted_below);
  CHECK(apart->rounds[0].registrations == set.inputs.registrations.size());
  CHECK(apart->variances.size() < shared.variances.size());

  const std::vector<Vertices> joined{shared.joined[0]};
  const auto& [reference, registrations, examples, scans] = set.inputs;
  CHECK(modelRegistrations(set.inputs, sharedSet().options, 0, {}) == registrations);
  auto all = registrations;
  all.push_back(joined[0]);
  CHECK(modelRegistrations(set.inputs, set.options, 1, joined) == all);
  for (std::size_t i = 0; i < examples.size(); ++i) all.insert(all.end() - 1, examples[i].registration);
  CHECK(modelRegistrations(set.inputs, sharedSet().options, 1, joined) == all);
}

TEST_CASE("a bootstrap resumed from any checkpoint gives the same bits") {
  const auto& set = sharedSet();
  const auto& [grown, states, progress, scans, rounds] = sharedRun();
  REQUIRE(grown);
  // After each example, field, scan and round; after the first round the examples are the registrations.
  auto expected = 2 + 1 + scans.size() + rounds.size() * 2 + grown->joined.size() + set.inputs.registrations.size() + 2;
  for (std::size_t r = 1; r < rounds.size(); ++r) expected += rounds[r].registrations;
  CHECK(states.size() == expected);
  std::size_t untold = scans.size();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (i < states.size() / 2 && i % 3 != 0) continue;  // those take longest
    const auto& state = states[i];
    INFO(state.stage());
    std::size_t told = 0, trained = 0;
    BootstrapWatch watch;
    watch.each_scan = [&](const BootstrapScan&) { ++told; };
    const FieldTrainer train = [&](const FieldTrainingSet& training, const std::stop_token& stop) {
      CHECK(training.training == state.trainings + 1 + int(trained++));
      return trainPullField(training, stop);
    };
    const auto resumed = bootstrapBody(set.inputs, train, set.options, watch, throughFile(state));
    REQUIRE(resumed);
    checkSame(*resumed, *grown);
    CHECK(told <= untold);  // what is done is not done again
    untold = told;
  }
  CHECK(untold == 0);
}

TEST_CASE("the number of threads makes no difference to a bootstrap") {
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const auto alone = bootstrapBody(sharedSet().inputs, trainPullField, sharedSet().options);
  REQUIRE(alone);
  checkSame(*alone, *sharedRun().grown);
}

TEST_CASE("a bootstrap that is stopped offers its state, and goes on from there") {
  const auto& set = sharedSet();
  const auto& whole = *sharedRun().grown;
  std::optional<BootstrapCheckpoint> kept;
  int stops = 0;
  for (; stops < 50; ++stops) {
    std::stop_source stop;
    int changes = 0;
    BootstrapWatch watch;
    watch.stop = stop.get_token();
    const auto before = kept;
    watch.checkpoint = [&](const auto& state) {
      if (++changes == 3) stop.request_stop();
      if (stop.stop_requested()) kept = throughFile(state());
    };
    const auto grown = bootstrapBody(set.inputs, trainPullField, set.options, watch, before);
    if (!grown) continue;
    checkSame(*grown, whole);
    break;
  }
  CHECK(stops > 3);
  CHECK(stops < 50);
}

TEST_CASE("a bootstrap ends when few join, or when no scan is left") {
  auto set = sharedSet();
  set.options.rounds = 5;
  set.options.acceptance = 0;  // the nearest alone
  set.options.least_joined = 2;
  const auto few = bootstrapBody(set.inputs, trainPullField, set.options);
  REQUIRE(few);
  CHECK(few->end == BootstrapEnd::kFewJoined);
  CHECK(few->rounds.size() == 1);
  CHECK(few->joined.size() == 1);

  set.options.acceptance = 100;  // all of them
  const auto all = bootstrapBody(set.inputs, trainPullField, set.options);
  REQUIRE(all);
  CHECK(all->end == BootstrapEnd::kNoneLeft);
  CHECK(all->rounds.size() == 1);
  CHECK(all->joined.size() == set.inputs.scans.count);
  CHECK(all->variances.size() > few->variances.size());
}

TEST_CASE("scans of something else never join, and what is no scan is told of once") {
  auto set = creatureBootstrap(4, 2, 2);
  const auto creatures = set.inputs.scans.load;
  const auto ball = tube(30, 20);
  set.inputs.scans.count = 4;
  set.inputs.scans.load = [&](std::size_t i) {
    if (i < 2) return creatures(i);
    if (i == 3) return Scan{Vertices::Zero(50, 3), {}, {}};
    const auto samples = sampleByArea(ball.topology->faces(), ball.vertices, 2000);
    return Scan{0.3 * samples.points, samples.normals, {}};
  };
  set.options.acceptance = 100;
  const auto grown = bootstrapBody(set.inputs, trainPullField, set.options);
  REQUIRE(grown);
  CHECK(grown->joined.size() == 2);
  const auto& first = grown->rounds[0].scans;
  CHECK((first[2].verdict == ScanVerdict::kDoubtful || first[2].verdict == ScanVerdict::kFailed));
  CHECK_FALSE(first[2].why.empty());
  CHECK(first[3].verdict == ScanVerdict::kUnusable);
  CHECK_THAT(first[3].why, Contains("50"));
  // The stranger is tried again, in vain; what is no scan is not.
  REQUIRE(grown->rounds.size() == 2);
  REQUIRE(grown->rounds[1].scans.size() == 1);
  CHECK(grown->rounds[1].scans[0].scan == 2);
  CHECK(grown->rounds[1].joined == 0);
  CHECK(grown->end == BootstrapEnd::kFewJoined);
}

TEST_CASE("an example's registration may stand anywhere in any posture, beside its scan or not") {
  auto set = creatureBootstrap(4, 2, 1);
  const auto& [reference, registrations, examples, scans] = set.inputs;
  std::vector<RestPair> there, elsewhere;
  const auto keeping = [](std::vector<RestPair>& pairs) -> FieldTrainer {
    return [&pairs](const FieldTrainingSet& training, const std::stop_token& stop) {
      if (pairs.empty()) pairs = training.pairs;
      return trainPullField(training, stop);
    };
  };
  set.options.rounds = 1;
  for (std::size_t i = 0; i < 2; ++i)
    set.inputs.examples[i].scan = scanOf(set, set.inputs.examples[i].registration, i + 1);
  REQUIRE(bootstrapBody(set.inputs, keeping(there), set.options));
  for (auto& example : set.inputs.examples) {
    example.registration = normalisedPosture(reference, example.registration, PostureNormalisation::kSkeleton);
    example.registration.rowwise() += Eigen::RowVector3d(1, 2, 3);
  }
  REQUIRE(bootstrapBody(set.inputs, keeping(elsewhere), set.options));
  REQUIRE(there.size() == 2);
  REQUIRE(elsewhere.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(there[i].source == elsewhere[i].source);
    CHECK(meanVertexDistance(there[i].target, elsewhere[i].target) < 3e-3);  // of a creature one metre long
    CHECK(meanVertexDistance(there[i].target, there[i].source) > 5e-3);
  }
}

TEST_CASE("faces go the same way as bodies: without a rig") {
  auto set = creatureBootstrap(0, 0, 0);
  const auto bodies = creatureBootstrap(5, 3, 0);
  const auto& topology = bodies.inputs.reference.topology;
  const auto& rest = bodies.inputs.reference.rest;
  set.inputs.reference = makePostureTemplate(topology, rest, rigidRig(rest));
  set.inputs.registrations.assign(bodies.inputs.registrations.begin(), bodies.inputs.registrations.begin() + 3);
  set.inputs.examples = {{bodies.inputs.registrations[3], std::nullopt}};
  const Scan scan = scanOf(set, bodies.inputs.registrations[4], 9);
  set.inputs.scans = {1, [&](std::size_t) { return scan; }, [](std::size_t) { return std::string("face"); }};
  set.options.rounds = 1;
  const auto grown = bootstrapBody(set.inputs, trainPullField, set.options);
  REQUIRE(grown);
  CHECK(grown->joined.size() == 1);
  CHECK(grown->model.skeleton().jointCount() == 1);
  const auto& found = grown->rounds[0].scans[0];
  CHECK(found.chamfer < 1.05 * found.model_chamfer);
  const auto& truth = bodies.inputs.registrations[4];
  const Vertices placed = apply(alignRigidly(grown->joined[0], truth), grown->joined[0]);
  CHECK(distancesToSurface(placed, truth, topology->faces()).mean() < 0.01);
}

TEST_CASE("a bootstrap says what it cannot work on") {
  const auto refused = [](const auto& change, const std::string& reason) {
    auto set = sharedSet();
    FieldTrainer train = trainPullField;
    change(set, train);
    CHECK_THROWS_AS(bootstrapBody(set.inputs, train, set.options), InvalidInput);
    CHECK_THROWS_WITH(bootstrapBody(set.inputs, train, set.options), Contains(reason));
  };
  refused([](auto& set, auto&) { set.options.rounds = 0; }, "options: rounds = 0");
  refused([](auto& set, auto&) { set.inputs.registrations.resize(1); }, "registrations: has 1, want at least two");
  refused([](auto& set, auto&) { set.inputs.registrations[2](5, 1) = std::nan(""); }, "registrations[2]");
  refused([](auto& set, auto&) { set.inputs.examples.clear(); }, "examples: are none");
  refused([](auto& set, auto&) { set.inputs.examples[1].registration.conservativeResize(7, 3); },
          "examples[1].registration");
  refused(
      [](auto& set, auto&) {
        set.inputs.examples[1].scan = Scan{Vertices::Zero(50, 3), {}, {}};
      },
      "examples[1].scan");
  refused([](auto& set, auto&) { set.inputs.scans.count = 0; }, "scans: there is none");
  refused([](auto& set, auto&) { set.inputs.scans.load = {}; }, "scans: have no function");
  refused([](auto&, auto& train) { train = {}; }, "train");
  refused([](auto& set, auto&) { set.options.registration.least_score = 1; }, "examples: none can be fitted");
  refused(
      [](auto&, auto& train) {
        train = [](const FieldTrainingSet& training, const std::stop_token&) {
          auto field = constantField(training.scaling);
          field.mlp[0].bias.resize(8);
          return std::optional(field);
        };
      },
      "mlp");
  // A field that folds everything up makes no shapes, and nobody joins.
  auto set = sharedSet();
  const FieldTrainer fold = [](const FieldTrainingSet& training, const std::stop_token&) {
    return std::optional(constantField(training.scaling, -Eigen::Matrix3d::Identity()));
  };
  const auto grown = bootstrapBody(set.inputs, fold, set.options);
  REQUIRE(grown);
  CHECK(grown->joined.empty());
  CHECK(grown->rounds[0].joined == 0);
}

TEST_CASE("checkpoints of a bootstrap are refused when damaged, or of other inputs") {
  const auto& set = sharedSet();
  const auto& states = sharedRun().states;
  const TemporaryFolder folder;
  auto state = states.at(states.size() / 2);
  state.training = "fingerprint";
  writeBootstrapCheckpoint(folder / "c", state);
  const auto read = readBootstrapCheckpoint(folder / "c");
  CHECK(read.training == "fingerprint");
  CHECK(read.stage() == state.stage());
  CHECK(read.joined == state.joined);
  auto bytes = bytesOf(folder / "c");
  bytes[bytes.size() - 9] ^= 1;
  CHECK_THROWS_WITH(readBootstrapCheckpoint(folder.file("d", bytes)), Contains("damaged"));

  auto other = creatureBootstrap(4, 3, 4);
  CHECK_THROWS_WITH(bootstrapBody(other.inputs, trainPullField, other.options, {}, read), Contains("checkpoint"));
  auto fewer = set;
  fewer.inputs.scans.count = 1;
  BootstrapCheckpoint late;
  late.scans.resize(1);
  late.scans[0].report.scan = 3;
  CHECK_THROWS_WITH(bootstrapBody(fewer.inputs, trainPullField, fewer.options, {}, late), Contains("checkpoint"));
}

TEST_CASE("a bootstrap learns what fits leave, and teaches the field what that leaves of bodies it has not seen") {
  auto set = creatureBootstrap(4, 6, 1);
  set.options.rounds = 1;
  set.options.virtual_scans = 2;
  std::vector<RestPair> pairs;
  const FieldTrainer keeping = [&](const FieldTrainingSet& training, const std::stop_token&) {
    if (pairs.empty()) pairs = training.pairs;
    return constantField(training.scaling);
  };
  std::optional<BootstrapCheckpoint> trained;
  BootstrapWatch watch;
  watch.checkpoint = [&](const auto& state) {
    auto now = state();
    if (now.trainings == 1 && now.field && !trained) trained = std::move(now);
  };
  REQUIRE(bootstrapBody(set.inputs, keeping, set.options, watch));
  REQUIRE(trained);
  CHECK(trained->examples.size() == 12);
  REQUIRE(trained->field->regression);
  BodyTrainingOptions training;
  training.modes = set.options.modes;
  const auto model = trainBody(set.inputs.reference, set.inputs.registrations, training)->model;
  REQUIRE(pairs.size() == 12);
  double fits = 0, begun = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    fits += meanVertexDistance(model.rest(trained->examples[i]->identity), pairs[i].target);
    begun += meanVertexDistance(pairs[i].source, pairs[i].target);
  }
  CHECK(begun < fits);
}
