#include "core/clothing/under_clothing.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <set>

#include "core/clothing/clothing_pairs.h"
#include "core/clothing/first_fits.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"
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

  /// The posture of one frame, the identity held.
  Solved<BodySequence> settleFrame(const BodyState& start, std::size_t frame, const ClothingWeights& weights) const {
    return settled({start.identity, {start.pose}}, {frame}, weights, false, true);
  }

  /// The identity by some frames, with their postures or with those held.
  Outcome settle(BodySequence& state, const std::vector<std::size_t>& frames, const ClothingWeights& weights,
                 bool postures) const {
    BodySequence some{state.identity, {}};
    for (const auto f : frames) some.poses.push_back(state.poses[f]);
    const auto result = settled(std::move(some), frames, weights, true, postures);
    state.identity = result.solution.identity;
    for (std::size_t i = 0; i < frames.size(); ++i) state.poses[frames[i]] = result.solution.poses[i];
    return result;
  }

  std::size_t size() const { return frames_.size(); }

  ClothedFrame measured(const BodyState& state, std::size_t frame, const Outcome& outcome) const {
    ClothedFrame result{state.pose, outcome, 0, 0, 0, false};
    frames_[frame].measure(model_.posed(state).vertices(), result);
    return result;
  }

 private:
  /// Closest points and steps in turn, until the surfaces stand still. One pose in `state` for each of `frames`.
  Solved<BodySequence> settled(BodySequence state, const std::vector<std::size_t>& frames,
                               const ClothingWeights& weights, bool identity, bool pose) const {
    Solved<BodySequence> result(std::move(state), {Termination::kIterationLimit, 0, 0});
    auto surfaces = surfacesOf(result.solution);
    for (int round = 0; round < options_.rounds; ++round) {
      std::vector<std::vector<SurfaceTarget>> targets;
      for (std::size_t i = 0; i < frames.size(); ++i) targets.push_back(frames_[frames[i]].find(surfaces[i], weights));
      const auto step = fitBodies(model_, result.solution, targets, fitOptions(targets, identity, pose));
      result.iterations += step.iterations;
      if (step.termination == Termination::kCancelled || step.termination == Termination::kNumericalFailure) {
        result.termination = step.termination;
        return result;
      }
      result.solution = step.solution;
      const auto moved = surfacesOf(result.solution);
      result.residual = 0;
      for (std::size_t i = 0; i < moved.size(); ++i)
        result.residual = std::max(result.residual, rmsVertexDistance(moved[i], surfaces[i]));
      surfaces = moved;
      if (result.residual <= options_.tolerance) {
        result.termination = Termination::kConverged;
        return result;
      }
    }
    return result;
  }

  std::vector<Vertices> surfacesOf(const BodySequence& state) const {
    std::vector<Vertices> surfaces;
    for (const auto& pose : state.poses) surfaces.push_back(model_.posed({state.identity, pose}).vertices());
    return surfaces;
  }

  BodyFitOptions fitOptions(const std::vector<std::vector<SurfaceTarget>>& targets, bool identity, bool pose) const {
    BodyFitOptions fit;
    // Weights are absolute here: what the cloth's term adds must not take from the data's.
    double weights = 0, count = 0;
    for (const auto& frame : targets)
      for (const auto& target : frame) weights += target.weight, count += 1;
    if (weights > 0) fit.observations *= weights / count;
    fit.sigma = 0.01;
    fit.pose_deviation = 0.5;
    fit.identity = identity;
    fit.pose = fit.placement = pose;
    fit.max_iterations = 3;
    fit.tolerance = 1e-7;  // a step not worth taking would pass for a surface at rest
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

/// The frames that fit well, best first: a missed posture must not speak of the identity.
std::vector<std::size_t> goodFrames(const std::vector<FirstFit>& fits, std::span<const std::vector<Landmark>> landmarks,
                                    double good_share) {
  std::vector<std::size_t> order(fits.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return fits[a].score > fits[b].score; });
  std::erase_if(order, [&, best = fits[order[0]].score](std::size_t f) {
    const bool shown = !landmarks.empty() && landmarks[f].size() >= 3;  // the posture is known
    return !shown && fits[f].score < good_share * best;
  });
  return order;
}

}  // namespace

ScanRegistrationOptions clothedRegistration() {
  ScanRegistrationOptions options;
  options.fit.pose_deviation = 1;
  options.fit.levels.erase(options.fit.levels.begin());  // limbs are searched for, and cloth has no finest level
  options.fit.levels.pop_back();
  return options;
}

std::optional<std::string> ClothingOptions::firstViolation() const {
  if (fitted_alone < 1) return "fitted_alone = " + std::to_string(fitted_alone) + ", want >= 1";
  if (first_frames < 1) return "first_frames = " + std::to_string(first_frames) + ", want >= 1";
  if (points < 50) return "points = " + std::to_string(points) + ", want >= 50";
  if (rounds < 1) return "rounds = " + std::to_string(rounds) + ", want >= 1";
  if (passes < 1) return "passes = " + std::to_string(passes) + ", want >= 1";
  for (const auto& [name, weights] : {std::pair{"first", first}, {"postures", postures}, {"refined", refined}})
    for (const double weight : {weights.landmarks, weights.data, weights.cloth})
      if (!(weight >= 0) || !std::isfinite(weight)) return std::string(name) + " holds a weight below 0";
  if (auto problem = unlessPositive("loss_scale", loss_scale)) return problem;
  if (auto problem = unlessPositive("outside_scale", outside_scale)) return problem;
  if (auto problem = unlessPositive("max_distance", max_distance)) return problem;
  if (auto problem = unlessPositive("tolerance", tolerance)) return problem;
  if (!(max_normal_angle > 0 && max_normal_angle <= 180))
    return "max_normal_angle = " + std::to_string(max_normal_angle) + ", want (0, 180]";
  if (!(good_share >= 0 && good_share <= 1)) return "good_share = " + std::to_string(good_share) + ", want 0 to 1";
  if (retries < 1) return "retries = " + std::to_string(retries) + ", want >= 1";
  return registration.firstViolation();
}

Solved<ClothedBody> estimateUnderClothing(std::span<const Scan> scans, const BodyModel& model,
                                          std::span<const std::vector<Landmark>> landmarks,
                                          const ClothingOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  requireInput(scans, landmarks);
  const Sequence sequence(scans, model, landmarks, options);
  FirstFits first_fits(scans, model, landmarks, options);
  const auto& fits = first_fits.run();
  Solved<ClothedBody> result;
  if (options.stop.stop_requested()) {
    result.termination = Termination::kCancelled;
    return result;
  }
  BodySequence state{fits[first_fits.best()].state.identity, {}};
  for (const auto& fit : fits) state.poses.push_back(fit.state.pose);
  const auto trusted = goodFrames(fits, landmarks, options.good_share);
  const std::size_t together = std::min(trusted.size(), std::size_t(options.first_frames));
  sequence.settle(state, {trusted.begin(), trusted.begin() + std::ptrdiff_t(together)}, options.first, true);
  std::vector<Outcome> outcomes(sequence.size());
  for (int pass = 0; pass < options.passes; ++pass) {
    for (std::size_t f = 0; f < sequence.size(); ++f) {
      tell(options, "posture " + std::to_string(f + 1),
           0.4 + 0.6 * (pass + double(f + 1) / double(sequence.size())) / options.passes);
      const auto posture = sequence.settleFrame({state.identity, state.poses[f]}, f, options.postures);
      outcomes[f] = posture;
      state.poses[f] = posture.solution.poses[0];
    }
    static_cast<Outcome&>(result) = sequence.settle(state, trusted, options.refined, false);
  }
  result.solution.identity = state.identity;
  for (std::size_t f = 0; f < sequence.size(); ++f)
    result.solution.frames.push_back(sequence.measured({state.identity, state.poses[f]}, f, outcomes[f]));
  for (std::size_t f = 0; f < sequence.size(); ++f) {
    auto& frame = result.solution.frames[f];
    frame.score = fits[f].score;
    frame.trusted = std::find(trusted.begin(), trusted.end(), f) != trusted.end();
  }
  return result;
}

}  // namespace shaped
