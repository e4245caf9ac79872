#pragma once

#include <vector>

#include "core/sample/creature.h"

namespace shaped {

/// How the bones of a creature are turned. Axes are the world's in the rest pose, also for children of turned bones.
struct CreaturePose {
  Eigen::Vector3d root = Eigen::Vector3d::Zero();  ///< displacement of the root joint, m
  std::vector<Eigen::Vector3d> rotations;          ///< of each bone relative to its parent: axis times angle, radians
};

/// Every bone at rest.
CreaturePose restPose(const SampleCreature& creature);

/// Where each bone carries the space around it: x = rotation * rest + translation.
struct BoneMotion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};
std::vector<BoneMotion> boneMotions(const SampleCreature& creature, const CreaturePose& pose);

/// The posed skin, V x 3, metres, by linear blend skinning. Throws InvalidInput when the pose has not one rotation a
/// bone.
Vertices pose(const SampleCreature& creature, const CreaturePose& pose);

}  // namespace shaped
