#include "core/bootstrap/field_examples.h"

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"
#include "core/sample/random.h"

namespace shaped {
namespace {

std::string fieldOf(std::size_t i, const char* part) { return "examples[" + std::to_string(i) + "]." + part; }

/// Mean distance of a scan to a shape at rest, m.
double distanceTo(const Vertices& shape, const Faces& faces, const Scan& scan) {
  return distancesToSurface(scan.points, shape, faces).mean();
}

/// The registration carried back by the pose; nothing where the pose leaves a vertex no way back.
std::optional<Vertices> carriedBack(const BodyModel& model, const BodyState& state, const Vertices& registration) {
  try {
    return unskinned(model.skeleton(), model.parts().weights, registration, model.restJoints(state.identity),
                     state.pose);
  } catch (const InvalidInput&) {
    return std::nullopt;
  }
}

}  // namespace

FieldExamples::FieldExamples(const BootstrapInputs& inputs, const BootstrapOptions& options)
    : inputs_(inputs), options_(options) {
  if (inputs.examples.empty()) throw InvalidInput("examples", "are none; the field is trained on one at least");
  for (std::size_t i = 0; i < inputs.examples.size(); ++i) {
    const auto& [registration, scan] = inputs.examples[i];
    requireValidShape(*inputs.reference.topology, registration, fieldOf(i, "registration"));
    if (scan) requireUsableScan(*scan, fieldOf(i, "scan"));
  }
}

FieldExamples::Scanned FieldExamples::scanned(std::size_t i) const {
  const auto& [registration, scan] = inputs_.examples[i];
  if (scan) return {preparedScan(*scan, options_.registration.unit_factor), registration};
  auto scanner = options_.scanner;
  scanner.seed = Random(options_.seed + i).bits();
  try {
    const auto made = scanVirtually(registration, inputs_.reference.topology->faces(), scanner);
    return {preparedScan(made.scan, 1), apply(made.motion, registration)};
  } catch (const InvalidInput& problem) {
    throw InvalidInput(fieldOf(i, "registration"), std::string("cannot be scanned: ") + problem.what());
  }
}

std::optional<BodyState> FieldExamples::fit(std::size_t i, const BodyModel& model, const std::stop_token& stop) const {
  auto registration = options_.registration;
  registration.field = nullptr;
  registration.refine = false;
  registration.stop = stop;
  registration.unit_factor = 1;  // scanned() is in metres
  const auto fitted = registerScan(scanned(i).scan, model, {}, registration);
  if (stop.stop_requested()) return std::nullopt;
  const bool usable = fitted.converged() || fitted.termination == Termination::kIterationLimit;
  if (!usable || fitted.solution.score < registration.least_score) return BodyState{};
  return fitted.solution.state;
}

RestPair FieldExamples::pair(std::size_t i, const BodyModel& model, const BodyState& state) const {
  const auto [scan, registration] = scanned(i);
  const auto& faces = model.topology()->faces();
  RestPair pair{model.rest(state.identity), {}, scanAtRest(model, state, ScanSurface(scan))};
  const Vertices normalised = normalisedPosture(inputs_.reference, registration, options_.posture, options_.reach);
  pair.target = apply(alignRigidly(normalised, pair.source), normalised);
  const auto carried = carriedBack(model, state, registration);
  if (carried && distanceTo(*carried, faces, pair.scan) <= distanceTo(pair.target, faces, pair.scan))
    pair.target = *carried;
  return pair;
}

}  // namespace shaped
