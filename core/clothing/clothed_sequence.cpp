#include "core/clothing/clothed_sequence.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/clothing/limb_poses.h"
#include "core/mesh/quality.h"

namespace shaped {
namespace {

/// At most so many of some frames, evenly.
std::vector<std::size_t> spread(const std::vector<std::size_t>& frames, std::size_t most) {
  std::vector<std::size_t> some;
  const std::size_t count = std::min(most, frames.size());
  for (std::size_t i = 0; i < count; ++i) some.push_back(frames[i * frames.size() / count]);
  return some;
}

/// Whether a limb begins where another ends, as a forearm does: it is tried with that one.
bool continuesOther(const Limb& limb, const std::vector<Limb>& limbs) {
  return std::any_of(limbs.begin(), limbs.end(), [&](const Limb& other) { return other.lower == limb.upper; });
}

}  // namespace

std::vector<Pose> posesOf(const BodySequence& state, const std::vector<std::size_t>& frames) {
  std::vector<Pose> poses;
  for (const auto f : frames) poses.push_back(state.poses[f]);
  return poses;
}

ClothedSequence::ClothedSequence(const std::deque<ScanSurface>& scans, const BodyModel& model,
                                 std::span<const std::vector<Landmark>> landmarks, const ClothingOptions& options)
    : scans_(scans), model_(model), options_(options), limbs_(limbsOf(model, options.limbs)) {
  static const std::vector<Landmark> none;
  for (std::size_t f = 0; f < scans.size(); ++f)
    frames_.emplace_back(scans[f], model, landmarks.empty() ? none : landmarks[f], options);
}

Outcome ClothedSequence::settleIdentity(BodySequence& state, const std::vector<std::size_t>& frames,
                                        const ClothingTerms& terms, const Eigen::VectorXd& tightness) const {
  const auto some = spread(frames, std::size_t(options_.together));
  const auto together =
      settled({state.identity, posesOf(state, some)}, some, terms, tightness, {true, true}, options_.rounds);
  state.identity = together.solution.identity;
  for (std::size_t i = 0; i < some.size(); ++i) state.poses[some[i]] = together.solution.poses[i];
  if (together.termination == Termination::kCancelled) return together;
  const auto alone =
      settled({state.identity, posesOf(state, frames)}, frames, terms, tightness, {true, false}, options_.rounds);
  state.identity = alone.solution.identity;
  return alone;
}

Outcome ClothedSequence::settlePosture(BodySequence& state, std::size_t frame, const ClothingTerms& terms,
                                       const Eigen::VectorXd& tightness) const {
  const auto result =
      settled({state.identity, {state.poses[frame]}}, {frame}, terms, tightness, {false, true}, options_.rounds);
  state.poses[frame] = result.solution.poses[0];
  return result;
}

void ClothedSequence::reseatLimbs(BodySequence& state, std::size_t frame, std::span<const Pose> others,
                                  const ClothingTerms& terms, const Eigen::VectorXd& tightness) const {
  const Vertices joints = model_.restJoints(state.identity);
  for (const auto& limb : limbs_)
    if (!continuesOther(limb, limbs_))
      keepBest(state, frame, otherLimbPoses(model_.skeleton(), joints, limb, state.poses[frame], others), terms,
               tightness);
}

void ClothedSequence::searchLimbs(BodySequence& state, std::size_t frame, const ClothingTerms& terms,
                                  const Eigen::VectorXd& tightness) const {
  std::vector<Pose> starts;
  for (const bool backwards : {false, true}) {
    auto search = options_.limbs;
    search.backwards = backwards;
    Pose straight = state.poses[frame];
    for (const auto& limb : limbs_) straighten(model_.skeleton(), limb.upper, straight);
    for (const auto& start : {state.poses[frame], straight})
      starts.push_back(
          shaped::searchLimbs(scans_[frame], model_, {state.identity, start}, search, options_.stop).state.pose);
  }
  keepBest(state, frame, starts, terms, tightness);
  reseatLimbs(state, frame, starts, terms, tightness);
}

void ClothedSequence::seatExtremities(BodySequence& state, std::size_t frame,
                                      const std::vector<std::size_t>& neighbours) const {
  const auto others = posesOf(state, neighbours);
  for (const auto joint : extremitiesOf(limbs_))
    seatExtremity(scans_[frame], model_, state.identity, joint, others, state.poses[frame], options_.extremities,
                  options_.stop);
}

void ClothedSequence::keepBest(BodySequence& state, std::size_t frame, std::span<const Pose> starts,
                               const ClothingTerms& terms, const Eigen::VectorXd& tightness) const {
  if (options_.stop.stop_requested()) return;
  double least = frames_[frame].misfit(surfaceOf(state.identity, state.poses[frame]));
  for (const auto& start : starts) {
    if (options_.stop.stop_requested()) return;
    const auto other = settled({state.identity, {start}}, {frame}, terms, tightness, {false, true}, 5);
    const double misfit = frames_[frame].misfit(surfaceOf(state.identity, other.solution.poses[0]));
    if (misfit < least) least = misfit, state.poses[frame] = other.solution.poses[0];
  }
}

Eigen::VectorXd ClothedSequence::tightness(const BodySequence& state, const std::vector<std::size_t>& frames) const {
  if (frames.size() < 3) return {};
  const auto count = Eigen::Index(frames_[0].vertices().size());
  Eigen::ArrayXXd gaps(count, Eigen::Index(frames.size()));
  for (std::size_t i = 0; i < frames.size(); ++i)
    gaps.col(Eigen::Index(i)) = frames_[frames[i]].gaps(surfaceOf(state.identity, state.poses[frames[i]])).array();
  const double square = options_.tight_spread * options_.tight_spread;
  Eigen::VectorXd tightness(count);
  for (Eigen::Index v = 0; v < count; ++v) {
    double seen = 0, sum = 0, squares = 0;
    for (const double gap : gaps.row(v))
      if (!std::isnan(gap)) seen += 1, sum += gap;
    for (const double gap : gaps.row(v))
      if (!std::isnan(gap)) squares += (gap - sum / seen) * (gap - sum / seen);
    const double tight = seen >= 3 ? square / (square + squares / (seen - 1)) : 0;
    tightness[v] = tight * tight;
  }
  // Relative to the tightest tenth: else a body that has become too thin, all of whose gaps vary, would find no data
  // to hold it, and shrink on.
  std::vector<double> sorted(tightness.begin(), tightness.end());
  const auto tenth = sorted.begin() + std::ptrdiff_t(0.9 * double(count - 1));
  std::nth_element(sorted.begin(), tenth, sorted.end());
  return *tenth > 0 ? Eigen::VectorXd(tightness / *tenth).cwiseMin(1) : Eigen::VectorXd();
}

ClothedFrame ClothedSequence::measured(const BodySequence& state, std::size_t frame, const Outcome& outcome) const {
  ClothedFrame result;
  result.pose = state.poses[frame];
  result.outcome = outcome;
  frames_[frame].measure(surfaceOf(state.identity, state.poses[frame]), result);
  return result;
}

Solved<BodySequence> ClothedSequence::settled(BodySequence state, const std::vector<std::size_t>& frames,
                                              const ClothingTerms& terms, const Eigen::VectorXd& tightness,
                                              Moving moving, int rounds) const {
  Solved<BodySequence> result(std::move(state), {Termination::kIterationLimit, 0, 0});
  std::vector<Vertices> surfaces;
  for (const auto& pose : result.solution.poses) surfaces.push_back(surfaceOf(result.solution.identity, pose));
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::vector<SurfaceTarget>> targets;
    for (std::size_t i = 0; i < frames.size(); ++i)
      targets.push_back(frames_[frames[i]].find(surfaces[i], terms, tightness));
    const auto step = fitBodies(model_, result.solution, targets, fitOptions(targets, moving));
    result.iterations += step.iterations;
    if (step.termination == Termination::kCancelled || step.termination == Termination::kNumericalFailure) {
      result.termination = step.termination;
      return result;
    }
    result.solution = step.solution;
    result.residual = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Vertices moved = surfaceOf(result.solution.identity, result.solution.poses[i]);
      result.residual = std::max(result.residual, rmsVertexDistance(moved, surfaces[i]));
      surfaces[i] = moved;
    }
    if (result.residual <= options_.tolerance) {
      result.termination = Termination::kConverged;
      return result;
    }
  }
  return result;
}

Vertices ClothedSequence::surfaceOf(const Eigen::VectorXd& identity, const Pose& pose) const {
  return model_.posed({identity, pose}).vertices();
}

BodyFitOptions ClothedSequence::fitOptions(const std::vector<std::vector<SurfaceTarget>>& targets,
                                           Moving moving) const {
  BodyFitOptions fit;
  // Weights are absolute here: what the cloth's term adds must not take from the data's.
  double weights = 0, count = 0;
  for (const auto& frame : targets)
    for (const auto& target : frame) weights += target.weight, count += 1;
  fit.observations = weights > 0 ? options_.observations * weights / count : options_.observations;
  fit.sigma = options_.sigma;
  fit.pose_deviation = 0.5;
  fit.identity = moving.identity;
  fit.pose = fit.placement = moving.pose;
  fit.max_iterations = 2;  // the pairs are renewed at once
  fit.tolerance = 1e-7;    // a step not worth taking would pass for a surface at rest
  fit.stop = options_.stop;
  return fit;
}

}  // namespace shaped
