#include "core/bootstrap/field_examples.h"

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/registration/fit_evidence.h"
#include "core/registration/pose_refit.h"
#include "core/registration/scan_checks.h"
#include "core/sample/random.h"
#include "core/skeleton/skinning.h"

namespace shaped {
namespace {

const std::optional<Scan> kNoScan;

std::string indexed(const char* list, std::size_t i) { return std::string(list) + "[" + std::to_string(i) + "]"; }

}  // namespace

FieldExamples::FieldExamples(const BootstrapInputs& inputs, const BootstrapOptions& options, std::size_t rounds,
                             const std::vector<Vertices>& joined)
    : inputs_(inputs), options_(options) {
  if (inputs.examples.empty()) throw InvalidInput("examples", "are none; the field is trained on one at least");
  for (std::size_t i = 0; i < inputs.examples.size(); ++i) {
    const auto& [registration, scan] = inputs.examples[i];
    const std::string name = indexed("examples", i);
    requireValidShape(*inputs.reference.topology, registration, name + ".registration");
    if (scan) requireUsableScan(*scan, name + ".scan");
    add(name + ".registration", registration, scan);
  }
  if (!options.share_registrations || rounds == 0) return;
  for (std::size_t i = 0; i < inputs.registrations.size(); ++i)
    add(indexed("registrations", i), inputs.registrations[i], kNoScan);
  for (std::size_t i = 0; i < joined.size(); ++i) add(indexed("joined", i), joined[i], kNoScan);
}

void FieldExamples::add(std::string name, const Vertices& registration, const std::optional<Scan>& scan) {
  scans_.insert(scans_.end(), scan ? 1 : static_cast<std::size_t>(options_.virtual_scans), examples_.size());
  examples_.push_back({std::move(name), registration, scan});
}

Vertices FieldExamples::atRest(std::size_t example) const {
  return normalisedPosture(inputs_.reference, examples_[example].registration, options_.posture, options_.reach);
}

/// The registration in a posture near rest.
Vertices FieldExamples::posed(std::size_t example, std::uint64_t seed) const {
  const auto& reference = inputs_.reference;
  const Vertices rest = atRest(example);
  Random random(seed);
  Pose pose = restPose(reference.rig.skeleton);
  for (Eigen::Index joint = 1; joint < pose.rotations.rows(); ++joint)
    for (int axis = 0; axis < 3; ++axis) pose.rotations(joint, axis) = options_.virtual_turns * random.normal();
  return PosedSkin(reference.rig.skeleton, reference.rig.weights, rest, reference.regressor * rest, pose).vertices();
}

Scan FieldExamples::scanned(std::size_t i) const {
  const auto example = scans_[i];
  if (const auto& scan = examples_[example].scan) return preparedScan(*scan, options_.registration.unit_factor);
  Random random(options_.seed + i);
  auto scanner = options_.scanner;
  scanner.seed = random.bits();
  try {
    return preparedScan(scanVirtually(posed(example, random.bits()), inputs_.reference.topology->faces(), scanner).scan,
                        1);
  } catch (const InvalidInput& problem) {
    throw InvalidInput(examples_[example].name, std::string("cannot be scanned: ") + problem.what());
  }
}

std::optional<BodyState> FieldExamples::fit(std::size_t i, const BodyModel& model, const std::stop_token& stop) const {
  auto registration = options_.registration;
  registration.field = nullptr;
  registration.refine = false;
  registration.stop = stop;
  registration.unit_factor = 1;  // scanned() is in metres
  const auto fitted = registerScan(scanned(i), model, {}, registration);
  if (stop.stop_requested()) return std::nullopt;
  const bool usable = fitted.converged() || fitted.termination == Termination::kIterationLimit;
  if (!usable || fitted.solution.score < registration.least_score) return BodyState{};
  return fitted.solution.state;
}

std::optional<ResidualExample> FieldExamples::residual(std::size_t i, const BodyModel& model,
                                                       const BodyState& state) const {
  const auto example = scans_[i];
  const Scan seen = scanAtRest(model, state, ScanSurface(scanned(i)));
  if (seen.points.rows() < kFewestScanPoints) return std::nullopt;
  const Vertices fitted = model.rest(state.identity);
  const Vertices normalised = atRest(example);
  const Vertices target = apply(alignRigidly(normalised, fitted), normalised);
  return ResidualExample{evidenceOf(state, fitted, model.topology()->faces(), seen), target - fitted, example};
}

std::optional<RestPair> FieldExamples::pair(std::size_t i, const BodyModel& model, const BodyState& state,
                                            const ResidualExample& residual, const Vertices& predicted) const {
  const Vertices fitted = model.rest(state.identity);
  const ScanSurface scan(scanned(i));
  const auto start =
      refitPose(model, fitted + predicted, state.pose, scan, options_.registration.fit, PoseRefit::kRough);
  RestPair pair{fitted + predicted, fitted + residual.residual, scanAtRest(start.body, start.state, scan),
                residual.subject};
  if (pair.scan.points.rows() < kFewestScanPoints) return std::nullopt;
  return pair;
}

}  // namespace shaped
