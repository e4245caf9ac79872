#include "core/scene/skinned_mesh.h"

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <span>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// The weights of one vertex: bone -> weight.
using VertexWeights = std::map<std::int32_t, double>;

class MeshJoiner {
 public:
  explicit MeshJoiner(const std::string& file) : file_(file) {}

  void add(const aiMesh& mesh) {
    const std::string name = quotedWord(mesh.mName.C_Str());
    const auto weights = weightsOf(mesh, name);
    std::vector<std::int32_t> indices(mesh.mNumVertices, -1);
    for (const auto& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
      if (face.mNumIndices != 3) fail("mesh " + name + " has a face that is no triangle");
      Eigen::RowVector3i corners;
      for (unsigned c = 0; c < 3; ++c) {
        const unsigned corner = face.mIndices[c];
        if (corner >= mesh.mNumVertices) fail("mesh " + name + " has a face with vertex " + std::to_string(corner));
        if (indices[corner] < 0) indices[corner] = weld(mesh.mVertices[corner], weights[corner], name, corner);
        corners[c] = indices[corner];
      }
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) faces_.push_back(corners);
    }
  }

  SkinnedMesh join(std::vector<std::string> left_out) {
    if (faces_.empty()) fail("has no mesh with a skin and faces");
    SkinnedMesh mesh{
        Vertices(vertices_.size(), 3), Faces(faces_.size(), 3), std::move(bones_), {}, std::move(left_out)};
    for (std::size_t v = 0; v < vertices_.size(); ++v) mesh.vertices.row(static_cast<Eigen::Index>(v)) = vertices_[v];
    for (std::size_t f = 0; f < faces_.size(); ++f) mesh.faces.row(static_cast<Eigen::Index>(f)) = faces_[f];
    mesh.weights.resize(mesh.vertices.rows(), static_cast<Eigen::Index>(mesh.bones.size()));
    mesh.weights.setFromTriplets(triplets_.begin(), triplets_.end());
    return mesh;
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw InvalidInput(file_, problem); }

  std::vector<VertexWeights> weightsOf(const aiMesh& mesh, const std::string& name) {
    std::vector<VertexWeights> weights(mesh.mNumVertices);
    for (const aiBone* bone : std::span(mesh.mBones, mesh.mNumBones)) {
      const auto index = boneIndex(*bone, name);
      for (const auto& entry : std::span(bone->mWeights, bone->mNumWeights)) {
        if (entry.mVertexId >= mesh.mNumVertices)
          fail("mesh " + name + " weighs vertex " + std::to_string(entry.mVertexId));
        if (!std::isfinite(entry.mWeight) || entry.mWeight < 0)
          fail("mesh " + name + " gives vertex " + std::to_string(entry.mVertexId) +
               " a weight that is below 0 or not finite");
        if (entry.mWeight > 0) weights[entry.mVertexId][index] += entry.mWeight;
      }
    }
    return weights;
  }

  std::int32_t boneIndex(const aiBone& bone, const std::string& mesh) {
    const std::string name = bone.mName.C_Str();
    const auto inverse_bind = affine(bone.mOffsetMatrix);
    if (!inverse_bind.matrix().allFinite() || !(std::abs(inverse_bind.linear().determinant()) > 1e-12))
      fail("joint " + quotedWord(name) + " has an inverse bind matrix that is not finite or cannot be inverted");
    const auto [known, added] = indices_.try_emplace(name, static_cast<std::int32_t>(bones_.size()));
    if (added)
      bones_.push_back({name, inverse_bind});
    else if (!bones_[static_cast<std::size_t>(known->second)].inverse_bind.isApprox(inverse_bind, 1e-5))
      fail("mesh " + mesh + " is bound to joint " + quotedWord(name) + " otherwise than a mesh before it");
    return known->second;
  }

  std::int32_t weld(const aiVector3D& position, const VertexWeights& weights, const std::string& mesh,
                    unsigned vertex) {
    const Eigen::RowVector3d place(position.x, position.y, position.z);
    const std::string where = "mesh " + mesh + " has a vertex " + std::to_string(vertex);
    if (!place.allFinite()) fail(where + " that is not finite");
    if (weights.empty()) fail(where + " that no bone carries");
    // Adding 0 makes one of 0 and -0.
    std::vector<double> key{place[0] + 0.0, place[1] + 0.0, place[2] + 0.0};
    for (const auto& [bone, weight] : weights) key.insert(key.end(), {static_cast<double>(bone), weight});
    const auto [known, added] = welded_.try_emplace(std::move(key), static_cast<std::int32_t>(vertices_.size()));
    if (added) {
      for (const auto& [bone, weight] : weights) triplets_.emplace_back(known->second, bone, weight);
      vertices_.push_back(place);
    }
    return known->second;
  }

  const std::string& file_;
  std::vector<Eigen::RowVector3d> vertices_;
  std::vector<Eigen::RowVector3i> faces_;
  std::vector<SceneBone> bones_;
  std::map<std::string, std::int32_t> indices_;  ///< of the bones by their names
  std::map<std::vector<double>, std::int32_t> welded_;
  std::vector<Eigen::Triplet<double>> triplets_;
};

}  // namespace

SkinnedMesh skinnedMesh(const std::string& file, const aiScene& scene) {
  MeshJoiner joiner(file);
  std::vector<std::string> left_out;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    if (mesh->HasBones() && mesh->HasPositions())
      joiner.add(*mesh);
    else
      left_out.emplace_back(mesh->mName.C_Str());
  }
  return joiner.join(std::move(left_out));
}

}  // namespace shaped
