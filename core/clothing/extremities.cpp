#include "core/clothing/extremities.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/numerics/error.h"
#include "core/registration/bone_turns.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// A pose and what it costs.
using Tried = std::pair<double, Pose>;

bool cheaper(const Tried& one, const Tried& other) { return one.first < other.first; }

/// Axis by axis the median of the poses and of rest: of two neighbours one may be wrong.
Pose medianOf(const Skeleton& skeleton, std::span<const Pose> poses) {
  Pose median = restPose(skeleton);
  std::vector<double> values;
  for (Eigen::Index i = 0; i < median.rotations.size(); ++i) {
    values.assign(1, 0);
    for (const auto& pose : poses) values.push_back(pose.rotations.data()[i]);
    std::sort(values.begin(), values.end());
    median.rotations.data()[i] = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  }
  return median;
}

class Seating {
 public:
  Seating(const BodyModel& model, const Eigen::VectorXd& identity, const PartFit& fit, const ExtremityOptions& options,
          const std::stop_token& stop)
      : skeleton_(model.skeleton()), joints_(model.restJoints(identity)), fit_(fit), options_(options), stop_(stop) {}

  Tried best(const Pose& pose, std::span<const Pose> others) const {
    std::vector<Tried> starts = turns(pose);
    for (const auto& other : others) starts.push_back(tried(as(other, pose)));
    Tried best = descended(pose);
    for (const auto& start : starts) {
      if (stop_.stop_requested()) return best;
      best = std::min(best, descended(start.second), cheaper);
    }
    for (const auto joint : fit_.joints())
      if (joint != fit_.joints().front()) bend(joint, best);
    return best;
  }

 private:
  Tried tried(const Pose& pose) const { return {fit_.cost(pose), pose}; }
  Tried descended(const Pose& pose) const { return tried(fit_.descended(pose)); }

  /// A pose with the part's joints as another has them.
  Pose as(const Pose& other, Pose pose) const {
    for (const auto j : fit_.joints()) pose.rotations.row(j) = other.rotations.row(j);
    return pose;
  }

  /// The best of a grid of turns of the first joint, those below it at rest.
  std::vector<Tried> turns(const Pose& pose) const {
    const auto joint = fit_.joints().front();
    const Eigen::Vector3d bone = (joints_.row(joint) - joints_.row(skeleton_.parent(joint))).transpose();
    Pose turned = as(restPose(skeleton_), pose);
    std::vector<Tried> all;
    for (const auto& turn : boneTurns(bone, {30, 60}, {0, -30, 30, -60, 60, -90, 90, -120, 120})) {
      if (stop_.stop_requested()) break;
      turned.rotations.row(joint) = axisAngle(turn).transpose();
      all.push_back(tried(turned));
    }
    std::stable_sort(all.begin(), all.end(), cheaper);
    all.resize(std::min(all.size(), std::size_t(options_.starts)));
    return all;
  }

  /// Tries one joint further down at rest and bent every way, and descends from the best.
  void bend(std::int32_t joint, Tried& best) const {
    const Eigen::Vector3d bone = (joints_.row(joint) - joints_.row(skeleton_.parent(joint))).transpose();
    if (bone.isZero(0) || stop_.stop_requested()) return;
    std::vector<Tried> all;
    Pose bent = best.second;
    for (const auto& turn : boneTurns(bone, {30, 60}, {0})) {
      bent.rotations.row(joint) = axisAngle(turn).transpose();
      all.push_back(tried(bent));
    }
    const auto start = std::min_element(all.begin(), all.end(), cheaper);
    best = std::min(best, descended(start->second), cheaper);
  }

  const Skeleton& skeleton_;
  Vertices joints_;
  const PartFit& fit_;
  const ExtremityOptions& options_;
  const std::stop_token& stop_;
};

}  // namespace

std::optional<std::string> ExtremityOptions::firstViolation() const {
  if (const auto problem = fit.firstViolation()) return "fit." + *problem;
  if (starts < 1) return "starts = " + std::to_string(starts) + ", want >= 1";
  if (!(least_gain >= 0) || !std::isfinite(least_gain))
    return "least_gain = " + std::to_string(least_gain) + ", want >= 0";
  return std::nullopt;
}

std::vector<std::int32_t> extremitiesOf(std::span<const Limb> limbs) {
  std::vector<std::int32_t> joints;
  for (const auto& limb : limbs)
    if (std::none_of(limbs.begin(), limbs.end(), [&](const Limb& other) { return other.upper == limb.lower; }))
      joints.push_back(limb.lower);
  return joints;
}

bool seatExtremity(const ScanSurface& scan, const BodyModel& model, const Eigen::VectorXd& identity, std::int32_t joint,
                   std::span<const Pose> others, Pose& pose, const ExtremityOptions& options,
                   const std::stop_token& stop) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("extremity options", *problem);
  const Pose likely = medianOf(model.skeleton(), others);
  const PartFit fit(scan, StandingBody(model, {identity, pose}), joint, likely, options.fit);
  if (!fit.tells()) return false;
  const Tried best = Seating(model, identity, fit, options, stop).best(pose, others);
  if (stop.stop_requested() || !(best.first < fit.cost(pose) - options.least_gain)) return false;
  pose = best.second;
  return true;
}

}  // namespace shaped
