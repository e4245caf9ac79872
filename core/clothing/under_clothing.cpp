#include "core/clothing/under_clothing.h"

#include <cmath>
#include <deque>

#include "core/clothing/clothing_pairs.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"

namespace shaped {
namespace {

/// The frames prepared, and what is known of the person so far.
class Sequence {
 public:
  Sequence(std::span<const Scan> scans, const BodyModel& model, std::span<const std::vector<Landmark>> landmarks,
           const ClothingOptions& options)
      : model_(model), options_(options) {
    static const std::vector<Landmark> none;
    for (std::size_t f = 0; f < scans.size(); ++f)
      frames_.emplace_back(scans[f], model, landmarks.empty() ? none : landmarks[f], options);
  }

  /// Identity and postures of some frames from a start, or whichever of them may change, until the surfaces stand
  /// still.
  Solved<BodySequence> settle(BodySequence state, std::size_t first, const ClothingWeights& weights, bool identity,
                              bool pose) const {
    Solved<BodySequence> result(std::move(state), {Termination::kIterationLimit, 0, 0});
    auto surfaces = surfacesOf(result.solution);
    for (int round = 0; round < options_.rounds; ++round) {
      std::vector<std::vector<SurfaceTarget>> targets;
      for (std::size_t f = 0; f < surfaces.size(); ++f)
        targets.push_back(frames_[first + f].find(surfaces[f], weights));
      const auto step = fitBodies(model_, result.solution, targets, fitOptions(identity, pose));
      result.iterations += step.iterations;
      if (step.termination == Termination::kCancelled || step.termination == Termination::kNumericalFailure) {
        result.termination = step.termination;
        return result;
      }
      result.solution = step.solution;
      const auto moved = surfacesOf(result.solution);
      result.residual = 0;
      for (std::size_t f = 0; f < moved.size(); ++f)
        result.residual = std::max(result.residual, rmsVertexDistance(moved[f], surfaces[f]));
      surfaces = moved;
      if (result.residual <= options_.tolerance) {
        result.termination = Termination::kConverged;
        return result;
      }
    }
    return result;
  }

  std::size_t size() const { return frames_.size(); }

  ClothedFrame measured(const BodyState& state, std::size_t frame, const Outcome& outcome) const {
    ClothedFrame result{state.pose, outcome, 0, 0};
    frames_[frame].measure(model_.posed(state).vertices(), result);
    return result;
  }

 private:
  std::vector<Vertices> surfacesOf(const BodySequence& state) const {
    std::vector<Vertices> surfaces;
    for (const auto& pose : state.poses) surfaces.push_back(model_.posed({state.identity, pose}).vertices());
    return surfaces;
  }

  BodyFitOptions fitOptions(bool identity, bool pose) const {
    BodyFitOptions fit;
    fit.sigma = 0.01;
    fit.pose_deviation = 0.5;
    fit.identity = identity;
    fit.pose = fit.placement = pose;
    fit.max_iterations = 4;
    fit.tolerance = 1e-4;
    fit.stop = options_.stop;
    return fit;
  }

  const BodyModel& model_;
  const ClothingOptions& options_;
  std::deque<ClothingPairs> frames_;
};

void requireInput(std::span<const Scan> scans, std::span<const std::vector<Landmark>> landmarks) {
  if (scans.empty()) throw InvalidInput("scans", "is empty, want at least one frame");
  if (!landmarks.empty() && landmarks.size() != scans.size())
    throw InvalidInput("landmarks", "has " + std::to_string(landmarks.size()) +
                                        " lists, want none or one for each of " + std::to_string(scans.size()) +
                                        " frames");
  for (std::size_t f = 0; f < scans.size(); ++f) requireUsableScan(scans[f], "scans[" + std::to_string(f) + "]");
}

/// Tells how far the sequence is.
void tell(const ClothingOptions& options, const std::string& stage, double fraction) {
  if (options.progress) options.progress({stage, fraction, 0});
}

}  // namespace

std::optional<std::string> ClothingOptions::firstViolation() const {
  const auto positive = [](const char* field, double value) -> std::optional<std::string> {
    if (value > 0 && std::isfinite(value)) return std::nullopt;
    return std::string(field) + " = " + std::to_string(value) + ", want > 0";
  };
  if (first_frames < 1) return "first_frames = " + std::to_string(first_frames) + ", want >= 1";
  if (points < 50) return "points = " + std::to_string(points) + ", want >= 50";
  if (rounds < 1) return "rounds = " + std::to_string(rounds) + ", want >= 1";
  if (passes < 1) return "passes = " + std::to_string(passes) + ", want >= 1";
  for (const auto& [name, weights] : {std::pair{"first", first}, {"postures", postures}, {"refined", refined}})
    for (const double weight : {weights.landmarks, weights.data, weights.cloth})
      if (!(weight >= 0) || !std::isfinite(weight)) return std::string(name) + " holds a weight below 0";
  if (auto problem = positive("loss_scale", loss_scale)) return problem;
  if (auto problem = positive("max_distance", max_distance)) return problem;
  if (auto problem = positive("tolerance", tolerance)) return problem;
  if (!(max_normal_angle > 0 && max_normal_angle <= 180))
    return "max_normal_angle = " + std::to_string(max_normal_angle) + ", want (0, 180]";
  return registration.firstViolation();
}

Solved<ClothedBody> estimateUnderClothing(std::span<const Scan> scans, const BodyModel& model,
                                          std::span<const std::vector<Landmark>> landmarks,
                                          const ClothingOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  requireInput(scans, landmarks);
  const Sequence sequence(scans, model, landmarks, options);
  ScanRegistrationOptions registration = options.registration;
  registration.stop = options.stop;
  tell(options, "first frame", 0);
  const auto known = landmarks.empty() ? std::vector<Landmark>() : landmarks[0];
  const BodyState begun = registerScan(scans[0], model, known, registration).solution.state;

  // Identity and postures of the first frames together, each posture from the one before.
  BodySequence state{begun.identity, {begun.pose}};
  const std::size_t together = std::min(sequence.size(), std::size_t(options.first_frames));
  for (std::size_t f = 0; f < together; ++f) {
    if (f > 0) {
      const auto alone = sequence.settle({state.identity, {state.poses.back()}}, f, options.first, false, true);
      state.poses.push_back(alone.solution.poses[0]);
    }
    state = sequence.settle(std::move(state), 0, options.first, true, true).solution;
  }

  Solved<ClothedBody> result;
  std::vector<Outcome> outcomes(sequence.size());
  for (int pass = 0; pass < options.passes; ++pass) {
    for (std::size_t f = 0; f < sequence.size(); ++f) {
      tell(options, "posture " + std::to_string(f + 1),
           (pass + double(f + 1) / double(sequence.size())) / options.passes);
      const Pose start = f < state.poses.size() ? state.poses[f] : state.poses.back();
      const auto posture = sequence.settle({state.identity, {start}}, f, options.postures, false, true);
      outcomes[f] = posture;
      if (f < state.poses.size())
        state.poses[f] = posture.solution.poses[0];
      else
        state.poses.push_back(posture.solution.poses[0]);
    }
    const auto refined = sequence.settle(state, 0, options.refined, true, false);
    state.identity = refined.solution.identity;
    static_cast<Outcome&>(result) = refined;
  }
  result.solution.identity = state.identity;
  for (std::size_t f = 0; f < sequence.size(); ++f)
    result.solution.frames.push_back(sequence.measured({state.identity, state.poses[f]}, f, outcomes[f]));
  return result;
}

}  // namespace shaped
