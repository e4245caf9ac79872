#pragma once

#include <string>
#include <vector>

#include "core/scene/node_motion.h"
#include "core/scene/scene_skeleton.h"

namespace shaped {

/// How the mesh was bound to the joints, and the transform that stands it at rest.
struct BoundPose {
  Eigen::Affine3d stand;                      ///< M: from the mesh as bound, in the file's unit, to our rest, in metres
  std::vector<Eigen::Affine3d> inverse_bind;  ///< B^-1 of each joint, from the mesh as bound
  Vertices rest_joints;                       ///< J x 3, m
};

/// M is what the first joint with a bone makes of the mesh without animation, in metres. Joints without a bone are
/// taken to be bound where they stand. Throws InvalidInput naming the file when M mirrors, shears or scales axes
/// differently.
BoundPose boundPose(const std::string& file, const aiScene& scene, const SkinnedMesh& mesh,
                    const std::vector<SceneJoint>& joints, double metres_per_unit);

}  // namespace shaped
