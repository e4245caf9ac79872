#pragma once

#include <vector>

#include "core/scene/skinned_mesh.h"

namespace shaped {

/// A node of the scene that is a joint of ours.
struct SceneJoint {
  const aiNode* node;
  std::int32_t parent;  ///< among the joints; -1 for the root
  std::int32_t bone;    ///< of the skinned mesh; -1 where the node is none
  bool matters;         ///< whether vertices hang on it or on a joint below
};

/// The nodes from the root joint down to every bone, depth first: see readGltfRig.
/// Throws InvalidInput naming the file when a bone has no node or its name stands at two.
std::vector<SceneJoint> sceneJoints(const std::string& file, const aiScene& scene, const SkinnedMesh& mesh);

}  // namespace shaped
