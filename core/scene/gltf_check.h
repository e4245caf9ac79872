#pragma once

#include <string>
#include <string_view>

namespace shaped {

/// Refuses a glTF document that assimp 5.2 would follow into nothing: it trusts that what a file refers to is there.
/// Checked are nodes (a forest, every reference), meshes, skins, accessors, buffer views, buffers and animations, as
/// far as a rig needs them; materials and pictures are not. bytes: of a .glb or a .gltf file. Throws InvalidInput
/// naming the file and the entry.
void requireSoundGltf(const std::string& file, std::string_view bytes);

}  // namespace shaped
