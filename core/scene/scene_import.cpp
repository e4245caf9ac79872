#include "core/scene/scene_import.h"

#include <assimp/postprocess.h>

#include "core/io/file.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "core/scene/gltf_check.h"

namespace shaped {
namespace {

/// A binary file carries what it needs; a text file names others beside it.
const aiScene* read(Assimp::Importer& importer, const std::filesystem::path& path) {
  const auto bytes = readFile(path);
  // Only checks: none of the steps that change data.
  constexpr unsigned steps = aiProcess_ValidateDataStructure;
  const bool binary = bytes.starts_with("glTF");
  if (!binary && path.extension() != ".gltf")
    throw InvalidInput(path.string(), "is no binary glTF; want a file that begins with 'glTF', or JSON named .gltf");
  requireSoundGltf(path.string(), bytes);
  return binary ? importer.ReadFileFromMemory(bytes.data(), bytes.size(), steps, "glb")
                : importer.ReadFile(path.string(), steps);
}

}  // namespace

std::unique_ptr<Assimp::Importer> importGltf(const std::filesystem::path& path) {
  auto importer = std::make_unique<Assimp::Importer>();
  const aiScene* scene = nullptr;
  std::string problem;
  try {
    scene = read(*importer, path);
    problem = importer->GetErrorString();
  } catch (const InvalidInput&) {
    throw;
  } catch (const std::exception& thrown) {
    problem = thrown.what();
  }
  if (scene == nullptr || scene->mRootNode == nullptr || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0)
    throw InvalidInput(path.string(), "is no glTF that can be read: " + (problem.empty() ? "incomplete" : problem));
  return importer;
}

Eigen::Affine3d affine(const aiMatrix4x4& matrix) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  for (unsigned row = 0; row < 3; ++row)
    for (unsigned column = 0; column < 4; ++column) result.matrix()(row, column) = matrix[row][column];
  return result;
}

}  // namespace shaped
