// Real characters: skinning by our rig and poses against assimp's data, skinned as the format says.
#include <assimp/Importer.hpp>
#include <catch2/catch.hpp>

#include "core/io/bvh.h"
#include "core/mesh/topology.h"
#include "core/scene/gltf.h"
#include "tests/support/assimp_witness.h"
#include "tests/support/literal_skinning.h"
#include "tests/support/real_data.h"

using namespace shaped;

namespace {

/// Where the corners of the scene's triangles are, 3 F x 3, skinned by its nodes at that time.
Vertices skinnedCorners(const aiScene& scene, const aiAnimation* animation, double seconds) {
  const auto worlds = test::nodeWorlds(scene, animation, seconds);
  std::vector<Eigen::RowVector3d> corners;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const auto& mesh = *scene.mMeshes[m];
    Vertices skinned = Vertices::Zero(mesh.mNumVertices, 3);
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(mesh.mNumVertices);
    for (unsigned b = 0; b < mesh.mNumBones; ++b) {
      const auto& bone = *mesh.mBones[b];
      const aiMatrix4x4 carry = worlds.at(bone.mName.C_Str()) * bone.mOffsetMatrix;
      for (unsigned w = 0; w < bone.mNumWeights; ++w) {
        const auto [vertex, weight] = std::pair(bone.mWeights[w].mVertexId, bone.mWeights[w].mWeight);
        const aiVector3D x = carry * mesh.mVertices[vertex];
        skinned.row(vertex) += weight * Eigen::RowVector3d(x.x, x.y, x.z);
        sums[vertex] += weight;
      }
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f)
      for (unsigned c = 0; c < 3; ++c) {
        const unsigned vertex = mesh.mFaces[f].mIndices[c];
        corners.push_back(skinned.row(vertex) / sums[vertex]);
      }
  }
  Vertices result(corners.size(), 3);
  for (std::size_t i = 0; i < corners.size(); ++i) result.row(static_cast<Eigen::Index>(i)) = corners[i];
  return result;
}

Vertices cornersOf(const Vertices& vertices, const Faces& faces) {
  Vertices corners(faces.size(), 3);
  for (Eigen::Index i = 0; i < faces.size(); ++i) corners.row(i) = vertices.row(faces.reshaped<Eigen::RowMajor>()[i]);
  return corners;
}

struct Character {
  const char* file;
  double metres;
  Eigen::Index vertices, faces;
  std::int32_t joints;
  std::size_t animations;
  std::size_t refused;
  double apart;  ///< m: how far skinning may be from assimp's
};

}  // namespace

TEST_CASE("skinning by the rig and poses of a glTF file is that of its nodes") {
  // Up to 1e-5 m where bones keep their lengths: the horse, 4 m from nose to hoof, scales its joints by 1.00001 and
  // less; CesiumMan, the fox and the kaiju stretch theirs.
  const std::vector<Character> characters{
      {"gltf_ccby/Fox.glb", 0.01, 290, 576, 22, 3, 0, 1e-5},
      {"gltf_ccby/CesiumMan.glb", 1, 2338, 4672, 19, 1, 0, 5e-3},
      {"mesh2motion_cc0/animations/horse-animations.glb", 1, 1709, 3414, 55, 14, 0, 1.2e-5},
      {"mesh2motion_cc0/animations/fox-animations.glb", 1, 833, 1654, 48, 14, 0, 1.1e-2},
      {"mesh2motion_cc0/animations/kaiju-animations.glb", 1, 1169, 2318, 57, 6, 4, 2.2e-2},
      {"mesh2motion_cc0/models-variation/fox-panda.glb", 1, 786, 1564, 47, 0, 0, 1e-5},
      {"webxr_hands_mit/left.glb", 1, 1159, 2314, 26, 0, 0, 1e-5}};
  for (const auto& character : characters) {
    const auto path = test::realData(character.file);
    if (!path) return;
    INFO(character.file);
    GltfOptions options;
    options.metres_per_unit = character.metres;
    const auto read = readGltfRig(*path, options);
    CHECK(read.vertices.rows() == character.vertices);
    CHECK(read.faces.rows() == character.faces);
    CHECK(read.rig.skeleton.jointCount() == character.joints);
    CHECK(read.animations.size() == character.animations);
    CHECK(read.refused.size() == character.refused);
    CHECK(read.left_out.empty());
    CHECK_NOTHROW(read.rig.requireValid(static_cast<std::int32_t>(character.vertices)));

    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path->string(), 0);
    REQUIRE(scene != nullptr);
    const Vertices rest = skinnedCorners(*scene, nullptr, 0) * character.metres;
    CHECK((cornersOf(read.vertices, read.faces) - rest).rowwise().norm().maxCoeff() < 1e-5);
    for (const auto& animation : read.animations) {
      INFO(animation.name);
      const aiAnimation* original = nullptr;
      for (unsigned a = 0; a < scene->mNumAnimations; ++a)
        if (animation.name == scene->mAnimations[a]->mName.C_Str()) original = scene->mAnimations[a];
      REQUIRE(original != nullptr);
      double apart = 0;
      for (std::size_t f = 0; f < animation.clip.frames.size(); f += 7) {
        const auto ours = test::skinLiterally(read.rig, read.vertices, animation.clip.frames[f]);
        const Vertices theirs = skinnedCorners(*scene, original, static_cast<double>(f) / 30) * character.metres;
        apart = std::max(apart, (cornersOf(ours, read.faces) - theirs).rowwise().norm().maxCoeff());
      }
      CHECK(apart < character.apart);
      CHECK(apart < animation.largest_misfit + 1e-5);
    }
  }
}

TEST_CASE("the seams of a glTF mesh are welded: animals are closed surfaces") {
  for (const std::string file :
       {"gltf_ccby/Fox.glb", "gltf_ccby/CesiumMan.glb", "mesh2motion_cc0/animations/horse-animations.glb",
        "mesh2motion_cc0/models-variation/fox-dog.glb", "webxr_hands_mit/right.glb"}) {
    const auto path = test::realData(file);
    if (!path) return;
    INFO(file);
    const auto read = readGltfRig(*path);
    CHECK(Topology(static_cast<std::int32_t>(read.vertices.rows()), read.faces).closed());
  }
}

TEST_CASE("assimp places the joints of a BVH clip where we do") {
  for (const std::string file : {"cmu_mocap/bvh/01_01.bvh", "cmu_mocap/bvh/131_02.bvh"}) {
    const auto path = test::realData(file);
    if (!path) return;
    INFO(file);
    const auto clip = readBvh(*path, 1);
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path->string(), 0);
    REQUIRE(scene != nullptr);
    REQUIRE(scene->mNumAnimations == 1);
    double apart = 0;
    for (std::size_t f = 0; f < clip.frames.size(); f += 97) {
      const auto worlds = test::nodeWorlds(*scene, scene->mAnimations[0],
                                           static_cast<double>(f) / scene->mAnimations[0]->mTicksPerSecond);
      const auto joints = poseSkeleton(clip.skeleton, clip.rest_joints, clip.frames[f]).joints;
      for (std::int32_t j = 0; j < clip.skeleton.jointCount(); ++j) {
        const auto& world = worlds.at(clip.skeleton.name(j));
        apart = std::max(apart, (joints.row(j) - Eigen::RowVector3d(world.a4, world.b4, world.c4)).norm());
      }
    }
    CHECK(apart < 1e-4);  // of a body of 30 units, in assimp's single precision
  }
}
