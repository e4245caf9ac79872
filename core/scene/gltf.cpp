#include "core/scene/gltf.h"

#include <cmath>
#include <span>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "core/scene/clip_conversion.h"

namespace shaped {
namespace {

bool positive(double value) { return value > 0 && std::isfinite(value); }

Skeleton skeletonOf(const std::string& file, const std::vector<SceneJoint>& joints) {
  std::vector<Joint> tree;
  for (const auto& joint : joints) tree.push_back({joint.node->mName.C_Str(), joint.parent});
  try {
    return Skeleton(std::move(tree));
  } catch (const InvalidInput& problem) {  // names that are empty or stand twice
    throw InvalidInput(file, std::string("has joints that make no skeleton: ") + problem.what());
  }
}

/// The weights of the bones as those of our joints.
NormalisedWeights jointWeights(const SkinnedMesh& mesh, const std::vector<SceneJoint>& joints) {
  std::vector<std::int32_t> joint_of(mesh.bones.size(), -1);
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (joints[j].bone >= 0) joint_of[static_cast<std::size_t>(joints[j].bone)] = static_cast<std::int32_t>(j);
  std::vector<Eigen::Triplet<double>> triplets;
  for (Eigen::Index v = 0; v < mesh.weights.rows(); ++v)
    for (SkinWeights::InnerIterator entry(mesh.weights, v); entry; ++entry)
      triplets.emplace_back(static_cast<std::int32_t>(v), joint_of[static_cast<std::size_t>(entry.col())],
                            entry.value());
  SkinWeights weights(mesh.weights.rows(), static_cast<Eigen::Index>(joints.size()));
  weights.setFromTriplets(triplets.begin(), triplets.end());
  return normaliseWeights(weights);
}

void convertAnimations(const aiScene& scene, const ClipConverter& converter, GltfRig& result) {
  for (const aiAnimation* animation : std::span(scene.mAnimations, scene.mNumAnimations)) {
    const std::string name = animation->mName.C_Str();
    try {
      auto [clip, misfit] = converter.convert(*animation);
      result.animations.push_back({name, std::move(clip), misfit});
    } catch (const InvalidInput& problem) {
      result.refused.push_back({name, problem.what()});
    }
  }
}

double diagonal(const Vertices& vertices) {
  return (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm();
}

}  // namespace

std::optional<std::string> GltfOptions::firstViolation() const {
  if (!positive(metres_per_unit)) return "metres_per_unit = " + shortest(metres_per_unit) + ", want a number above 0";
  if (!positive(rate_hz)) return "rate_hz = " + shortest(rate_hz) + ", want a number above 0";
  if (!(tolerance >= 0)) return "tolerance = " + shortest(tolerance) + ", want a number >= 0";
  return std::nullopt;
}

GltfRig readGltfRig(const std::filesystem::path& path, const GltfOptions& options) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("", *violation);
  const std::string file = path.string();
  const auto importer = importGltf(path);
  const aiScene& scene = *importer->GetScene();
  auto mesh = skinnedMesh(file, scene);
  const auto joints = sceneJoints(file, scene, mesh);
  const auto bound = boundPose(file, scene, mesh, joints, options.metres_per_unit);
  auto [weights, change] = jointWeights(mesh, joints);
  GltfRig result{(mesh.vertices * bound.stand.linear().transpose()).rowwise() + bound.stand.translation().transpose(),
                 mesh.faces,
                 {skeletonOf(file, joints), bound.rest_joints, std::move(weights), {}},
                 change,
                 {},
                 {},
                 std::move(mesh.left_out)};
  if (!result.vertices.allFinite()) throw InvalidInput(file, "stands its mesh at no finite place");
  const ClipConverter converter{scene,
                                joints,
                                bound,
                                result.rig.skeleton,
                                options.metres_per_unit,
                                options.rate_hz,
                                options.tolerance * diagonal(result.vertices)};
  convertAnimations(scene, converter, result);
  return result;
}

}  // namespace shaped
