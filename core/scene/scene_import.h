#pragma once

#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>

namespace shaped {

/// The scene in a glTF file as assimp has it: nothing triangulated, merged or moved. It lives as long as the importer.
/// Throws InvalidInput naming the file when it cannot be opened or is refused.
std::unique_ptr<Assimp::Importer> importGltf(const std::filesystem::path& path);

/// In double precision.
Eigen::Affine3d affine(const aiMatrix4x4& matrix);

}  // namespace shaped
