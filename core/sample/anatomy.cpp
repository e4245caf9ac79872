#include "core/sample/anatomy.h"

#include <algorithm>
#include <utility>

#include "core/numerics/error.h"

namespace shaped {
namespace {

using Eigen::Vector3d;

/// Grows the skeleton bone by bone.
struct Builder {
  std::vector<Bone> bones;

  int add(const std::string& name, int parent, Limb limb, const Vector3d& joint, const Vector3d& along,
          double joint_radius, double end_radius) {
    bones.push_back({name, parent, limb, joint, joint + along, joint_radius, end_radius});
    return static_cast<int>(bones.size()) - 1;
  }

  /// A bone that starts where its parent ends, with the same thickness there.
  int extend(const std::string& name, int parent, const Vector3d& along, double end_radius) {
    const Bone from = bones[static_cast<std::size_t>(parent)];
    return add(name, parent, from.limb, from.end, along, from.end_radius, end_radius);
  }

  const Bone& at(int bone) const { return bones[static_cast<std::size_t>(bone)]; }
};

struct Trunk {
  int pelvis, chest, head;
};

Trunk addTrunk(Builder& builder, const Proportions& p) {
  const double l = p.body_length, t = p.body_thickness, h = p.head_size;
  const int pelvis =
      builder.add("pelvis", -1, Limb::kTrunk, {0, 0, -0.20 * l}, Vector3d(0, 0.012, 0.13) * l, 0.100 * t, 0.095 * t);
  const int spine = builder.extend("spine", pelvis, Vector3d(0, -0.006, 0.13) * l, 0.112 * t);
  const int chest = builder.extend("chest", spine, Vector3d(0, 0.030, 0.13) * l, 0.092 * t);
  const int neck = builder.extend("neck", chest, Vector3d(0, 0.125, 0.085) * p.neck_length, 0.070 * t);
  // The skull sits on the neck with a size of its own, and the muzzle points ahead of it.
  const Vector3d skull = builder.at(neck).end;
  const int head = builder.add("head", neck, Limb::kTrunk, skull, Vector3d(0, 0.028, 0.058) * h, 0.078 * h, 0.074 * h);
  builder.add("muzzle", head, Limb::kTrunk, builder.at(head).end + Vector3d(0, -0.026, 0.030) * h,
              Vector3d(0, -0.022, 0.092) * h, 0.052 * h, 0.028 * h);
  return {pelvis, chest, head};
}

void addTail(Builder& builder, int pelvis, const Proportions& p) {
  const Vector3d root = builder.at(pelvis).joint + Vector3d(0, 0.035, -0.055) * p.body_thickness;
  const double l = p.tail_length, t = p.tail_thickness;
  const int first =
      builder.add("tail1", pelvis, Limb::kTail, root, Vector3d(0, 0.010, -0.105) * l, 0.034 * t, 0.036 * t);
  const int second = builder.extend("tail2", first, Vector3d(0, 0.050, -0.095) * l, 0.050 * t);
  const int third = builder.extend("tail3", second, Vector3d(0, 0.085, -0.070) * l, 0.047 * t);
  builder.extend("tail4", third, Vector3d(0, 0.085, -0.018) * l, 0.014 * t);
}

void addEar(Builder& builder, int head, Limb limb, double side, const Proportions& p) {
  const Vector3d skull = builder.at(head).joint;
  const std::string name = side > 0 ? "ear_left" : "ear_right";
  builder.add(name, head, limb, skull + Vector3d(side * 0.044, 0.066, 0.012) * p.head_size,
              Vector3d(side * 0.045, 0.105, -0.016) * p.head_size * p.ear_length, 0.034 * p.head_size,
              0.011 * p.head_size);
}

void addForeLeg(Builder& builder, int chest, Limb limb, double side, const Proportions& p) {
  const double l = p.leg_length, t = p.leg_thickness, w = p.body_thickness;
  const Vector3d shoulder = builder.at(chest).joint + Vector3d(side * 0.080 * w, -0.045 * w, 0.085 * p.body_length);
  const std::string suffix = side > 0 ? "_left" : "_right";
  const int upper = builder.add("upper_arm" + suffix, chest, limb, shoulder, Vector3d(side * 0.010, -0.150, -0.020) * l,
                                0.058 * t, 0.041 * t);
  const int lower = builder.extend("forearm" + suffix, upper, Vector3d(0, -0.150, 0.012) * l, 0.031 * t);
  builder.extend("paw" + suffix, lower, Vector3d(0, -0.014, 0.050) * l, 0.036 * t);
}

void addHindLeg(Builder& builder, int pelvis, Limb limb, double side, const Proportions& p) {
  const double l = p.leg_length, t = p.leg_thickness, w = p.body_thickness;
  const Vector3d hip = builder.at(pelvis).joint + Vector3d(side * 0.070 * w, -0.022 * w, 0.010);
  const std::string suffix = side > 0 ? "_left" : "_right";
  const int thigh =
      builder.add("thigh" + suffix, pelvis, limb, hip, Vector3d(side * 0.022, -0.145, 0.042) * l, 0.074 * t, 0.046 * t);
  const int shank = builder.extend("shank" + suffix, thigh, Vector3d(0, -0.110, -0.078) * l, 0.030 * t);
  const int foot = builder.extend("foot" + suffix, shank, Vector3d(0, -0.086, 0.018) * l, 0.033 * t);
  builder.extend("toes" + suffix, foot, Vector3d(0, -0.012, 0.052) * l, 0.036 * t);
}

void standOnGround(std::vector<Bone>& bones) {
  double lowest = 1e9;
  for (const auto& bone : bones)
    lowest = std::min({lowest, bone.joint.y() - bone.joint_radius, bone.end.y() - bone.end_radius});
  for (auto& bone : bones) {
    bone.joint.y() -= lowest;
    bone.end.y() -= lowest;
  }
}

}  // namespace

std::optional<std::string> Proportions::firstViolation() const {
  const std::pair<const char*, double> factors[] = {
      {"body_length", body_length}, {"body_thickness", body_thickness}, {"neck_length", neck_length},
      {"head_size", head_size},     {"leg_length", leg_length},         {"leg_thickness", leg_thickness},
      {"tail_length", tail_length}, {"tail_thickness", tail_thickness}, {"ear_length", ear_length}};
  for (const auto& [field, factor] : factors)
    if (!(factor >= 0.6 && factor <= 1.5))
      return std::string(field) + " = " + std::to_string(factor) + ", want 0.6 to 1.5";
  return std::nullopt;
}

std::vector<Bone> makeSkeleton(const Proportions& proportions) {
  if (const auto problem = proportions.firstViolation()) throw InvalidInput("proportions", *problem);
  Builder builder;
  const auto [pelvis, chest, head] = addTrunk(builder, proportions);
  addTail(builder, pelvis, proportions);
  addEar(builder, head, Limb::kEarLeft, 1, proportions);
  addEar(builder, head, Limb::kEarRight, -1, proportions);
  addForeLeg(builder, chest, Limb::kForeLeft, 1, proportions);
  addForeLeg(builder, chest, Limb::kForeRight, -1, proportions);
  addHindLeg(builder, pelvis, Limb::kHindLeft, 1, proportions);
  addHindLeg(builder, pelvis, Limb::kHindRight, -1, proportions);
  standOnGround(builder.bones);
  return std::move(builder.bones);
}

int boneIndex(const std::vector<Bone>& bones, const std::string& name) {
  const auto found = std::find_if(bones.begin(), bones.end(), [&](const Bone& bone) { return bone.name == name; });
  if (found == bones.end()) throw InvalidInput("bone", "there is none named " + name);
  return static_cast<int>(found - bones.begin());
}

}  // namespace shaped
