#include "core/registration/tip_seating.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/numerics/error.h"
#include "core/registration/bone_turns.h"
#include "core/skeleton/joint_reach.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// A pose and what it costs.
using Tried = std::pair<double, Pose>;

/// Where a tip may stand: as it does, tilted from there to all sides, and at rest.
std::vector<Pose> places(const PartFit& fit, const Eigen::RowVector3d& bone, const Pose& pose, double tilt) {
  const auto joint = fit.joints().front();
  const Eigen::Matrix3d stands = rotationMatrix(pose.rotations.row(joint).transpose());
  std::vector<Pose> all;
  for (const auto& turn : boneTurns(bone.transpose(), {tilt}, {0})) {
    all.push_back(pose);
    all.back().rotations.row(joint) = axisAngle(turn * stands).transpose();
  }
  all.push_back(pose);
  for (const auto j : fit.joints()) all.back().rotations.row(j).setZero();
  return all;
}

/// The best that a descent from any of them comes by.
Tried bestOf(const PartFit& fit, const std::vector<Pose>& places) {
  Tried best{std::numeric_limits<double>::infinity(), {}};
  for (const auto& place : places) {
    Pose end = fit.descended(place);
    const double cost = fit.cost(end);
    if (cost < best.first) best = {cost, std::move(end)};
  }
  return best;
}

}  // namespace

PartFitOptions tipFitDefaults() {
  PartFitOptions options;
  options.points = 250;
  options.rounds = 6;
  return options;
}

std::optional<std::string> TipOptions::firstViolation() const {
  if (const auto problem = fit.firstViolation()) return "fit." + *problem;
  for (const double reach : reaches)
    if (!(reach >= 0)) return "reaches holds " + std::to_string(reach) + ", want >= 0";
  if (!(tilt > 0 && tilt <= 180)) return "tilt = " + std::to_string(tilt) + ", want (0, 180] degrees";
  if (!(least_gain >= 0) || !std::isfinite(least_gain))
    return "least_gain = " + std::to_string(least_gain) + ", want >= 0";
  return std::nullopt;
}

std::vector<std::int32_t> tipsOf(const BodyModel& model, double largest_reach) {
  const auto& parts = model.parts();
  const auto reach =
      jointReach(parts.skeleton, parts.weights, parts.mean, model.restJoints(Eigen::VectorXd::Zero(model.modeCount())));
  std::vector<std::int32_t> tips;
  for (std::int32_t joint = 1; joint < parts.skeleton.jointCount(); ++joint) {
    const double mine = reach[std::size_t(joint)], above = reach[std::size_t(parts.skeleton.parent(joint))];
    if (mine > 0 && mine <= largest_reach && above > largest_reach) tips.push_back(joint);
  }
  return tips;
}

int seatTips(const ScanSurface& scan, const BodyModel& model, const Eigen::VectorXd& identity, Pose& pose,
             const TipOptions& options, const std::stop_token& stop) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("tip options", *problem);
  std::vector<std::int32_t> tips;
  for (const double reach : options.reaches)
    for (const auto joint : tipsOf(model, reach))
      if (std::ranges::find(tips, joint) == tips.end()) tips.push_back(joint);
  if (tips.empty()) return 0;
  const Pose likely = restPose(model.skeleton());
  std::optional<StandingBody> body(std::in_place, model, BodyState{identity, pose});
  int seated = 0;
  for (const auto joint : tips) {
    if (stop.stop_requested()) break;
    const PartFit fit(scan, *body, joint, likely, options.fit);
    const Eigen::RowVector3d bone =
        body->restJoints().row(joint) - body->restJoints().row(model.skeleton().parent(joint));
    if (!fit.tells() || bone.isZero(0)) continue;
    const Tried best = bestOf(fit, places(fit, bone, pose, options.tilt));
    if (!(best.first < fit.cost(pose) - options.least_gain)) continue;
    pose = best.second;
    body.emplace(model, BodyState{identity, pose});
    ++seated;
  }
  return seated;
}

}  // namespace shaped
