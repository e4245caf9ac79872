#include "core/sample/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/sample/random.h"

namespace shaped {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Angles in degrees around x (pitch: nose down, legs back), y (yaw: to the left) and z (roll). Each bone's rotation
/// vector is these three: the angles are small enough that their order does not matter for a natural look.
struct Turn {
  std::string_view bone;  ///< a bone, or both sides of a limb without the suffix: "thigh"
  Eigen::Vector3d angles;
};
using Posture = std::vector<Turn>;

struct Limit {
  std::string_view bone;
  Eigen::Vector3d low, high;  ///< degrees
};

const std::vector<Limit>& limits() {
  static const std::vector<Limit> table{
      {"pelvis", {-45, -180, -12}, {30, 180, 12}}, {"spine", {-14, -16, -8}, {20, 16, 8}},
      {"chest", {-14, -16, -8}, {18, 16, 8}},      {"neck", {-32, -32, -12}, {52, 32, 12}},
      {"head", {-26, -34, -16}, {30, 34, 16}},     {"muzzle", {-4, -4, -4}, {6, 4, 4}},
      {"tail1", {-42, -32, -8}, {38, 32, 8}},      {"tail2", {-28, -30, -8}, {28, 30, 8}},
      {"tail3", {-28, -30, -8}, {28, 30, 8}},      {"tail4", {-22, -24, -8}, {22, 24, 8}},
      {"ear", {-22, -14, -18}, {22, 14, 18}},      {"upper_arm", {-62, -10, -12}, {46, 10, 12}},
      {"forearm", {-18, -6, -4}, {62, 6, 4}},      {"paw", {-30, -8, -4}, {38, 8, 4}},
      {"thigh", {-52, -8, -10}, {38, 8, 10}},      {"shank", {-26, -6, -4}, {58, 6, 4}},
      {"foot", {-52, -6, -4}, {30, 6, 4}},         {"toes", {-30, -6, -4}, {34, 6, 4}}};
  return table;
}

/// Whether a bone is the one named, on either side.
bool matches(const Bone& bone, std::string_view name) {
  const std::string_view own = bone.name;
  return own == name || own == std::string(name) + "_left" || own == std::string(name) + "_right";
}

const std::vector<Posture>& postures() {
  static const Posture sit{{"pelvis", {-38, 0, 0}}, {"spine", {6, 0, 0}},      {"neck", {14, 0, 0}},
                           {"head", {18, 0, 0}},    {"upper_arm", {30, 0, 0}}, {"thigh", {-46, 0, 0}},
                           {"shank", {55, 0, 0}},   {"foot", {-22, 0, 0}},     {"toes", {28, 0, 0}},
                           {"tail1", {36, 0, 0}}};
  static const Posture bow{{"pelvis", {20, 0, 0}},  {"spine", {-8, 0, 0}},  {"chest", {-8, 0, 0}},
                           {"neck", {-26, 0, 0}},   {"head", {-6, 0, 0}},   {"upper_arm", {-58, 0, 0}},
                           {"forearm", {10, 0, 0}}, {"thigh", {-20, 0, 0}}, {"tail1", {-34, 0, 0}},
                           {"tail2", {-10, 0, 0}},  {"ear", {-14, 0, 0}}};
  static const Posture sniff{{"spine", {6, 0, 0}}, {"chest", {14, 0, 0}},      {"neck", {50, 0, 0}},
                             {"head", {16, 0, 0}}, {"upper_arm", {-16, 0, 0}}, {"tail1", {18, 0, 0}},
                             {"ear", {14, 0, 0}}};
  static const Posture leap{{"pelvis", {-16, 0, 0}}, {"spine", {-12, 0, 0}},     {"chest", {-10, 0, 0}},
                            {"neck", {6, 0, 0}},     {"upper_arm", {-46, 0, 0}}, {"forearm", {8, 0, 0}},
                            {"paw", {16, 0, 0}},     {"thigh", {36, 0, 0}},      {"shank", {-18, 0, 0}},
                            {"foot", {22, 0, 0}},    {"tail1", {24, 0, 0}},      {"tail2", {12, 0, 0}}};
  static const Posture gather{{"spine", {19, 0, 0}},     {"chest", {16, 0, 0}},   {"neck", {-24, 0, 0}},
                              {"upper_arm", {36, 0, 0}}, {"forearm", {14, 0, 0}}, {"thigh", {-44, 0, 0}},
                              {"shank", {14, 0, 0}},     {"tail1", {-14, 0, 0}}};
  static const Posture look{{"spine", {0, 10, 0}}, {"chest", {0, 14, 0}},  {"neck", {-12, 30, 0}},
                            {"head", {0, 30, 10}}, {"tail1", {0, -24, 0}}, {"tail2", {0, -20, 0}},
                            {"ear", {-8, 8, 0}}};
  static const std::vector<Posture> all{sit, bow, sniff, leap, gather, look};
  return all;
}

/// Adds a share of a posture, degrees; side -1 exchanges left and right turns.
void add(std::vector<Eigen::Vector3d>& angles, const SampleCreature& creature, const Posture& posture, double share,
         double side = 1) {
  for (const auto& turn : posture)
    for (std::size_t b = 0; b < angles.size(); ++b)
      if (matches(creature.bones[b], turn.bone))
        angles[b] += share * turn.angles.cwiseProduct(Eigen::Vector3d(1, side, side));
}

std::vector<Eigen::Vector3d> noAngles(const SampleCreature& creature) {
  return std::vector<Eigen::Vector3d>(creature.bones.size(), Eigen::Vector3d::Zero());
}

const Limit& limitOf(const Bone& bone) {
  return *std::find_if(limits().begin(), limits().end(), [&](const Limit& limit) { return matches(bone, limit.bone); });
}

CreaturePose withinLimits(const SampleCreature& creature, std::vector<Eigen::Vector3d> angles) {
  for (std::size_t b = 0; b < angles.size(); ++b) {
    const Limit& limit = limitOf(creature.bones[b]);
    angles[b] = kDegree * angles[b].cwiseMax(limit.low).cwiseMin(limit.high);
  }
  return {Eigen::Vector3d::Zero(), std::move(angles)};
}

/// One leg at its own phase: it swings, and folds while it moves forward.
void addStep(std::vector<Eigen::Vector3d>& angles, const SampleCreature& creature, const std::string& suffix, bool fore,
             double phase, double stride) {
  const double swing = std::sin(phase), lift = std::max(0.0, std::cos(phase));
  const auto turn = [&](const char* bone, double pitch) {
    angles[std::size_t(boneIndex(creature.bones, bone + suffix))].x() += stride * pitch;
  };
  turn(fore ? "upper_arm" : "thigh", -26 * swing + (fore ? 0 : -8 * lift));
  turn(fore ? "forearm" : "shank", 42 * lift * lift);
  turn(fore ? "paw" : "foot", (fore ? 24 : -30) * lift * lift);
  if (!fore) turn("toes", 14 * lift);
}

void addTrot(std::vector<Eigen::Vector3d>& angles, const SampleCreature& creature, double phase, double stride) {
  constexpr double half = std::numbers::pi;
  addStep(angles, creature, "_left", true, phase, stride);
  addStep(angles, creature, "_right", true, phase + half, stride);
  addStep(angles, creature, "_right", false, phase - 0.3, stride);
  addStep(angles, creature, "_left", false, phase + half - 0.3, stride);
  const double sway = stride * std::sin(phase), beat = stride * std::cos(2 * phase);
  add(angles, creature, {{"pelvis", {0, 3, 3}}, {"spine", {0, -4, -2}}, {"chest", {0, -3, -3}}, {"neck", {0, 2, 0}}},
      sway);
  add(angles, creature, {{"spine", {2.5, 0, 0}}, {"neck", {4, 0, 0}}, {"head", {-4, 0, 0}}, {"ear", {7, 0, 0}}}, beat);
  const double wag = stride * std::sin(phase - 0.9);
  add(angles, creature, {{"tail1", {0, 10, 0}}, {"tail2", {0, 12, 0}}}, wag);
  add(angles, creature, {{"tail3", {0, 12, 0}}, {"tail4", {0, 10, 0}}}, stride * std::sin(phase - 1.8));
}

/// The pose with its rotations reduced until no triangle is squeezed too much; on the ground.
Vertices groundedShape(const SampleCreature& creature, CreaturePose posed) {
  constexpr double least_area = 0.1;
  Vertices shape = pose(creature, posed);
  for (int attempt = 0;
       attempt < 12 && smallestAreaRatio(creature.topology->faces(), creature.rest, shape) < least_area; ++attempt) {
    for (auto& rotation : posed.rotations) rotation *= 0.9;
    shape = pose(creature, posed);
  }
  shape.col(1).array() -= shape.col(1).minCoeff();
  return shape;
}

}  // namespace

CreaturePose trot(const SampleCreature& creature, double phase, double stride) {
  auto angles = noAngles(creature);
  addTrot(angles, creature, phase, stride);
  return withinLimits(creature, std::move(angles));
}

CreaturePose randomPose(const SampleCreature& creature, std::uint64_t seed) {
  Random random(seed);
  auto angles = noAngles(creature);
  const double liveliness = random.uniform();
  addTrot(angles, creature, random.uniform(0, 2 * std::numbers::pi), 1 - 0.8 * liveliness);
  const auto& chosen = postures()[static_cast<std::size_t>(random.below(static_cast<int>(postures().size())))];
  add(angles, creature, chosen, liveliness, random.uniform() < 0.5 ? -1 : 1);
  add(angles, creature, postures().back(), random.uniform(-0.7, 0.7), random.uniform() < 0.5 ? -1 : 1);
  for (std::size_t b = 0; b < angles.size(); ++b) {
    if (creature.bones[b].parent < 0) continue;
    const Limit& limit = limitOf(creature.bones[b]);
    for (int axis = 0; axis < 3; ++axis)
      angles[b][axis] += 0.14 * (limit.high[axis] - limit.low[axis]) * random.normal();
  }
  return withinLimits(creature, std::move(angles));
}

std::vector<Vertices> samplePoses(const SampleCreature& creature, int n, std::uint64_t seed) {
  if (n < 0) throw InvalidInput("n", "is " + std::to_string(n) + ", want >= 0");
  std::vector<Vertices> shapes;
  Random seeds(seed);
  for (int i = 0; i < n; ++i) shapes.push_back(groundedShape(creature, randomPose(creature, seeds.bits())));
  return shapes;
}

std::vector<CreaturePose> sampleMotion(const SampleCreature& creature, int frames, double rate_hz, std::uint64_t seed) {
  Random random(seed);
  const double start = random.uniform(0, 2 * std::numbers::pi), gaze = random.uniform(0, 2 * std::numbers::pi);
  const double crouch_start = random.uniform(0, 2 * std::numbers::pi), side = random.uniform() < 0.5 ? -1 : 1;
  std::vector<CreaturePose> motion;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int frame = 0; frame < frames; ++frame) {
    const double time = frame / rate_hz, phase = start + 2 * std::numbers::pi * 1.3 * time;
    const double heading = side * (0.3 + 0.8 * time), speed = 0.8;  // rad, m/s
    auto angles = noAngles(creature);
    addTrot(angles, creature, phase, 0.9);
    add(angles, creature, postures().back(), std::sin(gaze + 2.6 * time));
    add(angles, creature, postures()[2], 0.25 + 0.25 * std::sin(crouch_start + 1.9 * time));
    angles[0].y() += heading / kDegree;
    CreaturePose posed = withinLimits(creature, std::move(angles));
    posed.root = place + Eigen::Vector3d(0, 0.012 * std::cos(2 * phase), 0);
    motion.push_back(std::move(posed));
    place += speed / rate_hz * Eigen::Vector3d(std::sin(heading), 0, std::cos(heading));
  }
  return motion;
}

}  // namespace shaped
