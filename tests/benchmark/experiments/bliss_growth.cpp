#include "tests/benchmark/experiments/bliss_growth.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <utility>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/registration/field_deformation.h"
#include "core/skeleton/foremost_joint.h"
#include "core/training/field_training.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// The learner of fields: the paper's networks, as long as SHAPED_EPOCHS says; with 0 the field stays as it begins, and
/// the regression is seen alone.
FieldTrainer trainerOf(int epochs) {
  return [epochs](const FieldTrainingSet& set, const std::stop_token& stop) -> std::optional<JacobianFieldWeights> {
    FieldArchitecture architecture;
    architecture.offsets = true;
    auto untrained = untrainedField(set.scaling, architecture, 1);
    if (epochs == 0) return untrained;
    std::vector<FieldPair> pairs;
    for (const auto& pair : set.pairs)
      pairs.push_back(makeFieldPair(set.reference, pair.source, pair.target, pair.scan, set.scaling));
    FieldTrainingOptions options;
    options.epochs = epochs;
    options.stop = stop;
    const Stopwatch watch;
    options.each_epoch = [&](const FieldEpoch& epoch, const FieldTrainingState&) {
      std::printf("  field: epoch %d, vertex %.3g m^2, jacobian %.3g, %.0f s\n", epoch.epoch, epoch.loss.vertex,
                  epoch.loss.jacobian, watch.wall());
      std::fflush(stdout);
    };
    auto trained = trainJacobianField(pairs, untrainedState(std::move(untrained)), options);
    if (trained.termination == Termination::kCancelled) return std::nullopt;
    return std::move(trained.solution.weights);
  };
}

/// What a bootstrap had learned at some time.
struct Snapshot {
  std::size_t rounds = 0;
  std::vector<Vertices> joined;
  JacobianFieldWeights field;
};

Snapshot snapshotOf(BootstrapCheckpoint&& state) {
  return {state.rounds.size(), std::move(state.joined), std::move(*state.field)};
}

/// Where the state after a training is kept; nothing where SHAPED_KEEP names no folder.
std::optional<std::filesystem::path> keptAt(const std::string& name, std::size_t training) {
  const char* folder = std::getenv("SHAPED_KEEP");
  if (!folder) return std::nullopt;
  std::filesystem::create_directories(folder);
  return std::filesystem::path(folder) / (name + "-" + std::to_string(training) + ".checkpoint");
}

/// Those of an earlier run.
std::vector<Snapshot> keptSnapshots(const std::string& name) {
  std::vector<Snapshot> snapshots;
  for (auto path = keptAt(name, 1); path && std::filesystem::exists(*path); path = keptAt(name, snapshots.size() + 1))
    snapshots.push_back(snapshotOf(readBootstrapCheckpoint(*path)));
  return snapshots;
}

void tellRound(const BootstrapRound& round) {
  std::printf("  round %d: %zu registrations, %zu scans tried, %zu joined below %.2f mm of %.2f to %.2f\n", round.round,
              round.registrations, round.scans.size(), round.joined, 1000 * round.accepted_below, 1000 * round.smallest,
              1000 * round.largest);
  std::fflush(stdout);
}

std::vector<Snapshot> snapshotsOf(const BootstrapInputs& inputs, const BootstrapOptions& options, int epochs,
                                  bool first_only, const std::string& name) {
  auto snapshots = keptSnapshots(name);
  if (!snapshots.empty()) return snapshots;
  std::stop_source stop;
  BootstrapWatch watch;
  watch.stop = stop.get_token();
  int seen = 0;
  watch.checkpoint = [&](const auto& state) {
    auto now = state();
    if (now.trainings == seen || !now.field) return;
    seen = now.trainings;
    if (const auto path = keptAt(name, snapshots.size() + 1)) writeBootstrapCheckpoint(*path, now);
    snapshots.push_back(snapshotOf(std::move(now)));
    if (first_only) stop.request_stop();
  };
  watch.progress = [](const Progress& progress) {
    if (progress.stage.find("held out") == std::string::npos) return;
    std::printf("  %s\n", progress.stage.c_str());
    std::fflush(stdout);
  };
  watch.each_round = tellRound;
  bootstrapBody(inputs, trainerOf(epochs), options, watch);
  return snapshots;
}

/// Those that SHAPED_TRIALS lists, as "1,21"; without it all.
std::vector<Trial> chosen(const std::vector<Trial>& trials) {
  const char* list = std::getenv("SHAPED_TRIALS");
  if (!list) return trials;
  std::vector<Trial> some;
  std::istringstream numbers(list);
  for (std::string number; std::getline(numbers, number, ',');) some.push_back(trials.at(std::stoul(number)));
  return some;
}

/// Mean distances over all trials, mm, and how those of registrations where they stand are spread.
struct Measured {
  double model_posed = 0, model_rest = 0, posed = 0, rest = 0, seconds = 0;
  double median = 0, worst = 0;
  std::string furthest = {};  ///< of one trial: where it is furthest off
};

/// The joint whose vertices lie furthest from the truth on average, as "RHand 24.1".
std::string worstJoint(const BodyModel& model, const Vertices& posed, const Vertices& truth) {
  const auto& skeleton = model.skeleton();
  Eigen::ArrayXd sums = Eigen::ArrayXd::Zero(skeleton.jointCount()), counts = sums;
  for (std::int32_t v = 0; v < posed.rows(); ++v) {
    const auto joint = foremostJoint(model.parts().weights, v);
    sums[joint] += 1000 * (posed.row(v) - truth.row(v)).norm();
    counts[joint] += 1;
  }
  Eigen::Index worst;
  const double distance = (sums / counts.max(1)).maxCoeff(&worst);
  return text("%s %.1f", skeleton.name(std::int32_t(worst)).c_str(), distance);
}

double distanceAtRest(const Vertices& shape, const Vertices& truth) {
  return 1000 * meanVertexDistance(apply(alignRigidly(shape, truth), shape), truth);
}

BodyModel modelOf(const BootstrapInputs& inputs, const BootstrapOptions& options, const Snapshot& snapshot) {
  BodyTrainingOptions training;
  training.posture = options.posture;
  training.modes = options.modes;
  const auto registrations = modelRegistrations(inputs, options, snapshot.rounds, snapshot.joined);
  return trainBody(inputs.reference, registrations, training)->model;
}

Measured measured(const BodyModel& model, const ScanRegistrationOptions& registration,
                  const std::vector<Trial>& trials) {
  std::vector<Measured> each(trials.size());
  const Stopwatch watch;
  tbb::parallel_for(std::size_t{0}, trials.size(), [&](std::size_t i) {
    const auto& [scan, posed, rest] = trials[i];
    const auto found = registerScan(scan, model, {}, registration).solution;
    each[i] = {1000 * meanVertexDistance(model.posed(found.state).vertices(), posed),
               distanceAtRest(model.rest(found.state.identity), rest), 1000 * meanVertexDistance(found.vertices, posed),
               found.field ? distanceAtRest(found.field->rest, rest) : 0};
    each[i].furthest = worstJoint(model, found.vertices, posed);
  });
  if (std::getenv("SHAPED_EACH"))
    for (std::size_t i = 0; i < each.size(); ++i)
      std::printf("  trial %zu: posed %.2f (model %.2f), rest %.2f (model %.2f) mm, furthest %s\n", i, each[i].posed,
                  each[i].model_posed, each[i].rest, each[i].model_rest, each[i].furthest.c_str());
  Measured sum;
  const double count = double(trials.size());
  for (const auto& one : each) {
    sum.model_posed += one.model_posed / count;
    sum.model_rest += one.model_rest / count;
    sum.posed += one.posed / count;
    sum.rest += one.rest / count;
  }
  std::ranges::sort(each, {}, &Measured::posed);
  sum.median = each[each.size() / 2].posed;
  sum.worst = each.back().posed;
  sum.seconds = watch.cpu() / count;
  return sum;
}

/// With the model and the field of a snapshot.
Measured measured(const BootstrapInputs& inputs, const BootstrapOptions& options, const Snapshot& snapshot,
                  const std::vector<Trial>& trials) {
  const BodyModel model = modelOf(inputs, options, snapshot);
  auto registration = options.registration;
  registration.field = FieldDeformation::make(model, snapshot.field);
  return measured(model, registration, trials);
}

/// What template fitting makes of the fits of the first model.
void tellBaselines(Report& report, const BootstrapInputs& inputs, const BootstrapOptions& options,
                   const std::vector<Trial>& trials) {
  const BodyModel model = modelOf(inputs, options, {});
  for (const auto& [what, method] : {std::pair{"affine fitting", FittingMethod::kAffine},
                                     {"small displacements", FittingMethod::kDisplacement},
                                     {"kept edge lengths", FittingMethod::kEdgeLengths}}) {
    auto registration = options.registration;
    registration.refine = true;
    registration.refinement.method = method;
    const auto found = measured(model, registration, trials);
    report.entry(text("first model, then %s: v2v posed, mean (worst); CPU s a scan", what),
                 text("%.2f (%.2f) mm; %.2f s", found.posed, found.worst, found.seconds));
  }
}

void tell(Report& report, const std::string& what, const Measured& of) {
  report.entry(what + ", v2v posed: model's fit; with the field, mean, median (worst)",
               text("%.2f; %.2f, %.2f (%.2f) mm, %.2f times", of.model_posed, of.posed, of.median, of.worst,
                    of.posed / of.model_posed));
  report.entry(what + ", v2v at rest: model's fit; with the field; CPU s a scan",
               text("%.2f; %.2f mm, %.2f times; %.2f s", of.model_rest, of.rest, of.rest / of.model_rest, of.seconds));
}

}  // namespace

int setting(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

void grow(Report& report, BootstrapInputs inputs, const BootstrapOptions& options,
          const std::vector<Trial>& all_trials) {
  const auto trials = chosen(all_trials);
  if (setting("SHAPED_BASELINES", 1) != 0) tellBaselines(report, inputs, options, trials);
  const int epochs = setting("SHAPED_EPOCHS", 20);
  const auto snapshots = snapshotsOf(inputs, options, epochs, false, "grown");
  for (const auto& snapshot : snapshots)
    tell(report,
         text("after %zu rounds, %zu registrations", snapshot.rounds,
              modelRegistrations(inputs, options, snapshot.rounds, snapshot.joined).size()),
         measured(inputs, options, snapshot, trials));
  for (std::size_t i = 0, count = inputs.registrations.size(); i < count; ++i)
    inputs.examples.push_back({inputs.registrations[i], std::nullopt});
  inputs.registrations.clear();
  for (const auto& example : inputs.examples) inputs.registrations.push_back(example.registration);
  const auto whole = snapshotsOf(inputs, options, epochs, true, "all");
  tell(report, "model and field of all registrations", measured(inputs, options, whole.front(), trials));
}

BootstrapInputs growthInputs(const PostureTemplate& reference, const std::vector<Vertices>& known,
                             std::shared_ptr<const std::vector<Scan>> scans) {
  BootstrapInputs inputs{reference, {}, {}, {}};
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (i < known.size() / 2)
      inputs.registrations.push_back(known[i]);
    else
      inputs.examples.push_back({known[i], std::nullopt});
  }
  inputs.scans = {scans->size(), [scans](std::size_t i) { return (*scans)[i]; },
                  [](std::size_t i) { return "scan " + std::to_string(i); }};
  return inputs;
}

BootstrapOptions growthOptions() {
  BootstrapOptions options;
  options.posture = PostureNormalisation::kNone;
  options.rounds = setting("SHAPED_ROUNDS", 3);
  options.acceptance = setting("SHAPED_ACCEPTANCE", 1);
  options.sample = setting("SHAPED_SAMPLE", 0);
  options.share_registrations = setting("SHAPED_SHARED", 1) != 0;
  return options;
}

}  // namespace shaped::experiments
