#include "core/registration/scan_to_model.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"
#include "core/registration/landmark_targets.h"
#include "core/registration/model_pairs.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

BodyFitOptions fitOptions(const ModelFitOptions& options, const ModelFitLevel& level) {
  BodyFitOptions fit;
  fit.sigma = level.sigma;
  fit.observations = options.observations;
  fit.pose_deviation = options.pose_deviation;
  fit.identity = options.identity;
  // The pairs are renewed at once: a few steps on the old ones are enough. With two, people in motion were missed.
  fit.max_iterations = 3;
  fit.tolerance = 1e-7;  // a step not worth taking would pass for a surface at rest
  fit.stop = options.stop;
  return fit;
}

/// One level: pairs and steps in turn until the surface stands still.
Outcome runLevel(const ModelPairs& pairs, const BodyModel& model, const std::vector<SurfaceTarget>& landmarks,
                 const ModelFitOptions& options, const ModelFitLevel& level, BodyState& state) {
  Outcome outcome{Termination::kIterationLimit, 0, 0};
  Vertices surface = model.posed(state).vertices();
  for (int round = 0; round < level.rounds; ++round) {
    auto targets = pairs.find(surface, level);
    if (targets.empty() && landmarks.empty()) return {Termination::kStalled, outcome.iterations, outcome.residual};
    targets.insert(targets.end(), landmarks.begin(), landmarks.end());
    const auto step = fitBody(model, state, targets, fitOptions(options, level));
    outcome.iterations += step.iterations;
    if (step.termination == Termination::kCancelled || step.termination == Termination::kNumericalFailure)
      return {step.termination, outcome.iterations, outcome.residual};
    state = step.solution;
    const Vertices moved = model.posed(state).vertices();
    outcome.residual = rmsVertexDistance(moved, surface);
    surface = moved;
    if (outcome.residual <= options.tolerance) {
      outcome.termination = Termination::kConverged;
      break;
    }
  }
  return outcome;
}

}  // namespace

std::optional<std::string> ModelFitOptions::firstViolation() const {
  if (levels.empty()) return "levels is empty, want at least one";
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const std::string at = "levels[" + std::to_string(l) + "].";
    if (levels[l].points < 50) return at + "points = " + std::to_string(levels[l].points) + ", want >= 50";
    if (levels[l].rounds < 1) return at + "rounds = " + std::to_string(levels[l].rounds) + ", want >= 1";
    if (auto problem = unlessPositive(at + "max_distance", levels[l].max_distance)) return problem;
    if (auto problem = unlessPositive(at + "loss_scale", levels[l].loss_scale)) return problem;
    if (auto problem = unlessPositive(at + "sigma", levels[l].sigma)) return problem;
  }
  if (!(max_normal_angle > 0 && max_normal_angle <= 180))
    return "max_normal_angle = " + std::to_string(max_normal_angle) + ", want (0, 180]";
  if (!(landmark_weight >= 0) || !std::isfinite(landmark_weight))
    return "landmark_weight = " + std::to_string(landmark_weight) + ", want >= 0";
  if (auto problem = unlessPositive("pose_deviation", pose_deviation)) return problem;
  if (auto problem = unlessPositive("observations", observations)) return problem;
  return unlessPositive("tolerance", tolerance);
}

Solved<ModelFit> fitModelToScan(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                                const std::vector<Landmark>& landmarks, const ModelFitOptions& options) {
  auto fitted = fitStateToScan(scan, model, start, landmarks, options);
  Solved<ModelFit> result;
  static_cast<Outcome&>(result) = fitted;
  result.solution.state = std::move(fitted.solution);
  if (result.termination == Termination::kCancelled) return result;  // the report would take long
  result.solution.report =
      ModelPairs(scan, model, options).report(model.posed(result.solution.state).vertices(), options.levels.back());
  return result;
}

Solved<BodyState> fitStateToScan(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                                 const std::vector<Landmark>& landmarks, const ModelFitOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  const auto pulls = landmarkTargets(landmarks, model.topology()->faces(), options.landmark_weight);
  const ModelPairs pairs(scan, model, options);
  Solved<BodyState> result;
  result.solution = start;
  for (const auto& level : options.levels) {
    const Outcome outcome = runLevel(pairs, model, pulls, options, level, result.solution);
    result.termination = outcome.termination;
    result.iterations += outcome.iterations;
    result.residual = outcome.residual;
    if (outcome.termination != Termination::kConverged && outcome.termination != Termination::kIterationLimit) break;
  }
  return result;
}

BodyState placedState(const BodyModel& model, const RigidMotion& motion) {
  return carried(model, model.meanState(), motion);
}

BodyState carried(const BodyModel& model, const BodyState& state, const RigidMotion& motion) {
  BodyState moved = state;
  const Eigen::Matrix3d turn = rotationMatrix(state.pose.rotations.row(0).transpose());
  moved.pose.rotations.row(0) = axisAngle(motion.rotation * turn).transpose();
  const Eigen::Vector3d root = model.restJoints(state.identity).row(0).transpose();
  moved.pose.translation = motion.rotation * (root + state.pose.translation) + motion.translation - root;
  return moved;
}

}  // namespace shaped
