#pragma once

#include <string>
#include <vector>

#include "core/scene/scene_import.h"
#include "core/skeleton/rig.h"

namespace shaped {

/// A node that carries vertices.
struct SceneBone {
  std::string name;
  Eigen::Affine3d inverse_bind;  ///< from the mesh to the bone as they were bound
};

/// The skinned meshes of a scene as one, welded.
struct SkinnedMesh {
  Vertices vertices;  ///< as they were bound, in the file's unit
  Faces faces;
  std::vector<SceneBone> bones;
  SkinWeights weights;                ///< V x bones, as the file has them
  std::vector<std::string> left_out;  ///< meshes without bones
};

/// Throws InvalidInput naming the file: see readGltfRig.
SkinnedMesh skinnedMesh(const std::string& file, const aiScene& scene);

}  // namespace shaped
