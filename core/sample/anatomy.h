#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace shaped {

/// Body proportions as factors of the default creature, each in [0.6, 1.5].
struct Proportions {
  double body_length = 1;
  double body_thickness = 1;
  double neck_length = 1;
  double head_size = 1;
  double leg_length = 1;
  double leg_thickness = 1;
  double tail_length = 1;
  double tail_thickness = 1;
  double ear_length = 1;

  std::optional<std::string> firstViolation() const;  ///< "leg_length = 3, want 0.6 to 1.5"
};

/// Bones that one tapered tube after the other make a smooth limb; limbs then blend into each other.
enum class Limb { kTrunk, kTail, kEarLeft, kEarRight, kForeLeft, kForeRight, kHindLeft, kHindRight };
inline constexpr int kLimbCount = 8;

/// A bone, from its joint to its end, with the thickness of the body around it. Metres; y up, front +z, left +x.
struct Bone {
  std::string name;
  int parent;  ///< index of the bone whose end or side carries this joint; -1 for the root, which comes first
  Limb limb;
  Eigen::Vector3d joint, end;
  double joint_radius, end_radius;
};

/// The skeleton of a small four-legged animal with ears and a bushy tail, about 1 m from nose to tail, standing on the
/// plane y = 0. Parents come before children. Throws InvalidInput when a factor is out of range.
std::vector<Bone> makeSkeleton(const Proportions& proportions);

/// Index of a bone by its name; every name the library asks for exists.
int boneIndex(const std::vector<Bone>& bones, const std::string& name);

}  // namespace shaped
