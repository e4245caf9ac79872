#include "core/sample/marker_trial.h"

#include <Eigen/Geometry>
#include <limits>

#include "core/numerics/error.h"
#include "core/sample/motion.h"
#include "core/sample/random.h"

namespace shaped {
namespace {

/// A place on the skin: where a ray from a bone, at a share of its length, leaves the body.
struct Spot {
  std::string label, bone;
  double along;               ///< 0 at the joint, 1 at the end
  Eigen::Vector3d direction;  ///< from the bone to the skin
};

/// One side's markers of paired spots: label and bone get the side, x its sign.
void addPaired(std::vector<Spot>& spots, const Spot& left) {
  for (const double side : {1.0, -1.0}) {
    Spot spot = left;
    spot.label.insert(0, side > 0 ? "L" : "R");
    if (spot.bone.ends_with("_")) spot.bone += side > 0 ? "left" : "right";
    spot.direction.x() *= side;
    spots.push_back(spot);
  }
}

std::vector<Spot> spots() {
  std::vector<Spot> all{
      {"NOSE", "muzzle", 1, {0, 0.5, 1}},    {"FHEAD", "head", 1, {0, 1, 0.6}},   {"NAPE", "neck", 0.95, {0, 0.4, -1}},
      {"WITH", "chest", 0.8, {0, 1, -0.2}},  {"BACK", "spine", 0.4, {0, 1, 0}},   {"STRN", "chest", 0.9, {0, -0.6, 1}},
      {"RUMP", "pelvis", 0.1, {0, 1, 0}},    {"BELY", "spine", 0.3, {0, -1, 0}},  {"TAIL1", "tail1", 0.9, {0, 1, -0.2}},
      {"TAIL2", "tail3", 0.1, {0, 0.6, -1}}, {"TAIL3", "tail4", 0.2, {0, 0, -1}}, {"TAIL4", "tail4", 1, {0, 1, 0}}};
  addPaired(all, {"CHEK", "head", 0.9, {1, -0.1, 0.2}});
  addPaired(all, {"EAR", "ear_", 1, {0.3, 1, 0}});
  addPaired(all, {"RIB", "spine", 1, {1, 0.1, 0}});
  addPaired(all, {"SHO", "upper_arm_", 0.1, {1, 0, 0.3}});
  addPaired(all, {"ELB", "forearm_", 0, {0.4, 0, -1}});
  addPaired(all, {"PAW", "paw_", 0.7, {0.2, 1, 0.4}});
  addPaired(all, {"HIP", "thigh_", 0.1, {1, 0.3, 0}});
  addPaired(all, {"KNE", "shank_", 0, {0.5, 0, 1}});
  addPaired(all, {"HOC", "foot_", 0, {0.3, 0, -1}});
  addPaired(all, {"TOE", "toes_", 0.7, {0.2, 1, 0.4}});
  return all;
}

std::int32_t nearestVertex(const Vertices& vertices, const Eigen::Vector3d& point) {
  Eigen::Index nearest = 0;
  (vertices.rowwise() - point.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
  return static_cast<std::int32_t>(nearest);
}

/// Marks missing samples: a fifth of them single, the others in runs of 4 to 12 frames, as occluded markers vanish.
void dropSamples(MarkerTrial& trial, double share, Random& random) {
  const auto frames = static_cast<int>(trial.frames.size());
  const auto drop = [&](int frame, Eigen::Index marker) {
    trial.frames[static_cast<std::size_t>(frame)].row(marker).setConstant(std::numeric_limits<double>::quiet_NaN());
  };
  for (Eigen::Index marker = 0; marker < trial.frames[0].rows(); ++marker)
    for (int frame = 0; frame < frames; ++frame) {
      if (random.uniform() < 0.2 * share) drop(frame, marker);
      if (random.uniform() >= 0.8 * share / 8) continue;
      const int end = std::min(frames, frame + 4 + random.below(9));
      for (; frame < end; ++frame) drop(frame, marker);
    }
}

}  // namespace

std::optional<std::string> SampleTrialOptions::firstViolation() const {
  if (frames < 1) return "frames = " + std::to_string(frames) + ", want >= 1";
  if (!(rate_hz > 0)) return "rate_hz = " + std::to_string(rate_hz) + ", want > 0";
  if (!(noise >= 0)) return "noise = " + std::to_string(noise) + ", want >= 0";
  if (!(dropout >= 0 && dropout <= 0.5)) return "dropout = " + std::to_string(dropout) + ", want 0 to 0.5";
  return std::nullopt;
}

MarkerSet creatureMarkers(const SampleCreature& creature) {
  MarkerSet set;
  for (const auto& spot : spots()) {
    const Bone& bone = creature.bones[std::size_t(boneIndex(creature.bones, spot.bone))];
    const double radius = (1 - spot.along) * bone.joint_radius + spot.along * bone.end_radius;
    const Eigen::Vector3d centre = (1 - spot.along) * bone.joint + spot.along * bone.end;
    set.markers.emplace_back().label = spot.label;
    set.markers.back().vertex = nearestVertex(creature.rest, centre + radius * spot.direction.normalized());
  }
  return set;
}

SampleTrial sampleMarkerTrial(const SampleCreature& creature, const SampleTrialOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  SampleTrial result{creatureMarkers(creature), {{}, options.rate_hz, {}}, {}};
  for (const auto& marker : result.markers.markers) result.trial.labels.push_back(marker.label);
  Random random(options.seed);
  for (const auto& posed : sampleMotion(creature, options.frames, options.rate_hz, random.bits())) {
    result.truth.push_back(pose(creature, posed));
    Vertices seen(Eigen::Index(result.markers.markers.size()), 3);
    for (Eigen::Index m = 0; m < seen.rows(); ++m)
      for (int axis = 0; axis < 3; ++axis)
        seen(m, axis) =
            result.truth.back()(result.markers.markers[std::size_t(m)].vertex, axis) + options.noise * random.normal();
    result.trial.frames.push_back(std::move(seen));
  }
  dropSamples(result.trial, options.dropout, random);
  return result;
}

}  // namespace shaped
