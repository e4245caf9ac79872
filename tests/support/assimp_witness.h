#pragma once

#include <assimp/scene.h>

#include <map>
#include <string>

namespace shaped::test {

/// The world transform of every node by its name, as assimp's own (single-precision) types make it; animation: null for
/// the scene as it stands.
std::map<std::string, aiMatrix4x4> nodeWorlds(const aiScene& scene, const aiAnimation* animation, double seconds);

}  // namespace shaped::test
