#include "core/scene/gltf.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "core/numerics/error.h"
#include "tests/support/gltf_writer.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;
using nlohmann::json;

namespace {

using Transforms = std::vector<Eigen::Affine3d>;

constexpr double kQuarter = std::numbers::pi / 2;

const Eigen::Affine3d& hipBind() {
  static const Eigen::Affine3d bind =
      Eigen::Translation3d(0, 1, 0) * Eigen::AngleAxisd(kQuarter, Eigen::Vector3d::UnitZ());
  return bind;
}

/// Nodes 0 Armature (turned by a quarter about x, twice as large, at (0, 0, 1)) > 1 hip > 2 knee, and 3 Body. In the
/// mesh the hip is at (0, 1, 0), its x axis upwards, and the knee one above it. A seam and a place of two weights.
struct Arm {
  test::GltfBuffer data;
  json document;

  Arm() {
    const float half = static_cast<float>(std::sqrt(0.5));
    document = {
        {"asset", {{"version", "2.0"}}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0, 3}}}}},
        {"nodes",
         {{{"name", "Armature"},
           {"rotation", {half, 0, 0, half}},
           {"scale", {2, 2, 2}},
           {"translation", {0, 0, 1}},
           {"children", {1}}},
          {{"name", "hip"}, {"rotation", {0, 0, half, half}}, {"translation", {0, 1, 0}}, {"children", {2}}},
          {{"name", "knee"}, {"translation", {1, 0, 0}}},
          {{"name", "Body"}, {"mesh", 0}, {"skin", 0}, {"translation", {9, 9, 9}}}}},
        {"meshes", json::array({mesh({0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0},
                                     {1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 1, 0, 0, 0})})},
        {"skins",
         {{{"joints", {1, 2}},
           {"inverseBindMatrices",
            data.add(Transforms{hipBind().inverse(), (hipBind() * Eigen::Translation3d(1, 0, 0)).inverse()})}}}},
        {"animations", json::array()}};
  }

  json mesh(const std::vector<std::uint16_t>& joints, const std::vector<float>& weights) {
    json attributes = {
        {"POSITION", data.add(std::vector<float>{0, 0.5f, 0, 0, 1.5f, 0.5f, 0, 2.5f, 0, 0, 1.5f, 0.5f, 0, 2.5f, 0}, 3)},
        {"JOINTS_0", data.add(joints, 4)},
        {"WEIGHTS_0", data.add(weights, 4)}};
    const int indices = data.add(std::vector<std::uint16_t>{0, 1, 2, 0, 3, 4, 1, 3, 2}, 1);
    return {{"name", "body"}, {"primitives", {{{"attributes", attributes}, {"indices", indices}}}}};
  }

  /// An animation with keys at 0 s and 1 s. values: of both keys.
  void animate(const std::string& name, int node, const std::string& path, const std::vector<float>& values,
               const std::string& interpolation = "LINEAR") {
    const int times = data.add(std::vector<float>{0, 1}, 1), keys = data.add(values, path == "rotation" ? 4 : 3);
    document["animations"].push_back(
        {{"name", name},
         {"samplers", {{{"input", times}, {"output", keys}, {"interpolation", interpolation}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}}});
  }

  GltfRig read(const GltfOptions& options = {}) {
    auto finished = document;
    data.finish(finished);
    const test::TemporaryFolder folder;
    return readGltfRig(folder.file("arm.gltf", finished.dump()), options);
  }
};

bool near(const Eigen::RowVector3d& one, const Eigen::RowVector3d& other) { return (one - other).norm() < 1e-6; }

void checkRefused(Arm& arm, const std::string& error) {
  CHECK_THROWS_AS(arm.read(), InvalidInput);
  CHECK_THROWS_WITH(arm.read(), Contains("arm.gltf: ") && Contains(error));
}

}  // namespace

TEST_CASE("a glTF mesh stands where the transforms above its root joint put it, its seams welded") {
  const auto read = Arm().read();
  // x -> 2 (x, -z, y) + (0, 0, 1), whatever the mesh's own node says
  REQUIRE(read.vertices.rows() == 4);
  CHECK(near(read.vertices.row(0), {0, 0, 2}));
  CHECK(near(read.vertices.row(1), {0, -1, 4}));
  CHECK(near(read.vertices.row(2), {0, 0, 6}));
  CHECK(near(read.vertices.row(3), {0, 0, 6}));  // of other weights
  CHECK(read.faces == (Faces(2, 3) << 0, 1, 2, 0, 1, 3).finished());
  CHECK(read.rig.skeleton.jointCount() == 2);
  CHECK(read.rig.skeleton.name(0) == "hip");
  CHECK(read.rig.skeleton.name(1) == "knee");
  CHECK(near(read.rig.rest_joints.row(0), {0, 0, 3}));
  CHECK(near(read.rig.rest_joints.row(1), {0, 0, 5}));
  CHECK(read.rig.weights.coeff(1, 0) == 0.5);
  CHECK(read.rig.weights.coeff(1, 1) == 0.5);
  CHECK(read.rig.weights.coeff(2, 1) == 1);
  CHECK(read.rig.weights.coeff(3, 0) == 1);
  CHECK(read.largest_weight_change == 0);
  GltfOptions inches;
  inches.metres_per_unit = 0.0254;
  const auto small = Arm().read(inches);
  CHECK((small.vertices - 0.0254 * read.vertices).norm() < 1e-14);
  CHECK((small.rig.rest_joints - 0.0254 * read.rig.rest_joints).norm() < 1e-14);
}

TEST_CASE("a glTF joint's turn about its own axes becomes one in frames that are the world's at rest") {
  Arm arm;
  const float half = static_cast<float>(std::sqrt(0.5));
  arm.animate("bend", 2, "rotation", {0, 0, 0, 1, 0, 0, half, half});
  arm.animate("rise", 1, "translation", {0, 1, 0, 0, 2, 0});
  GltfOptions options;
  options.metres_per_unit = 0.5;
  options.rate_hz = 4;
  const auto read = arm.read(options);
  REQUIRE(read.animations.size() == 2);
  const auto& bend = read.animations[0];
  CHECK(bend.name == "bend");
  CHECK(bend.clip.rate_hz == 4);
  CHECK(bend.largest_misfit < 1e-6);
  REQUIRE(bend.clip.frames.size() == 5);
  for (std::size_t f = 0; f < 5; ++f) {
    CHECK(near(bend.clip.frames[f].rotations.row(0), {0, 0, 0}));
    // the mesh's z axis, about which the knee turns, is the world's -y
    CHECK(near(bend.clip.frames[f].rotations.row(1), {0, -kQuarter * static_cast<double>(f) / 4, 0}));
    CHECK(near(bend.clip.frames[f].translation.transpose(), {0, 0, 0}));
  }
  const auto& rise = read.animations[1];
  CHECK(near(rise.clip.frames[4].translation.transpose(), {0, 0, 1}));  // twice 1 up, in halves of a metre
  CHECK(near(rise.clip.frames[4].rotations.row(1), {0, 0, 0}));
}

TEST_CASE("STEP and CUBICSPLINE go straight from key to key") {
  Arm arm;
  const std::vector<float> jump{0, 1, 0, 0, 2, 0};
  arm.animate("linear", 1, "translation", jump);
  arm.animate("step", 1, "translation", jump, "STEP");
  // slope before, value, slope after: of each key
  arm.animate("spline", 1, "translation", {7, 7, 7, 0, 1, 0, 7, 7, 7, 7, 7, 7, 0, 2, 0, 7, 7, 7}, "CUBICSPLINE");
  const auto read = arm.read();
  REQUIRE(read.animations.size() == 3);
  for (const auto& animation : read.animations) {
    INFO(animation.name);
    CHECK(near(animation.clip.frames[15].translation.transpose(), {0, 0, 1}));
    CHECK(near(animation.clip.frames[30].translation.transpose(), {0, 0, 2}));
  }
}

TEST_CASE("a glTF animation that poses cannot say is refused with the joint and the frame, and the others are kept") {
  Arm arm;
  arm.animate("still", 2, "translation", {1, 0, 0, 1, 0, 0});
  arm.animate("stretch", 2, "translation", {1, 0, 0, 1.5, 0, 0});
  arm.animate("grow", 2, "scale", {1, 1, 1, 1, 2, 1});
  arm.animate("shrink", 0, "scale", {2, 2, 2, 1, 1, 1});
  const auto read = arm.read();
  REQUIRE(read.animations.size() == 1);
  CHECK(read.animations[0].name == "still");
  REQUIRE(read.refused.size() == 3);
  CHECK(read.refused[0].name == "stretch");
  CHECK_THAT(read.refused[0].reason, Contains("joint 'knee' stands 0.03") &&
                                         Contains(" m off where bones of fixed lengths hold it (tolerance 0.02") &&
                                         Contains("in frame 1"));
  CHECK_THAT(read.refused[1].reason, Contains("joint 'knee' changes its scale in frame 1"));
  CHECK_THAT(read.refused[2].reason, Contains("joint 'hip' changes its scale in frame 1"));
  GltfOptions lenient;
  lenient.tolerance = 1;
  const auto more = arm.read(lenient);
  REQUIRE(more.animations.size() == 2);
  CHECK(more.animations[1].largest_misfit == Approx(1).epsilon(1e-6));  // half a unit, twice as large
}

TEST_CASE("joints at the top that carry nothing are folded away, and one is made where several roots need it") {
  Arm arm;
  arm.document["nodes"][0]["children"] = {4};
  arm.document["nodes"].push_back({{"name", "root"}, {"children", {1, 5}}});
  arm.document["nodes"].push_back({{"name", "pole"}});
  arm.document["skins"][0]["joints"] = {1, 2, 4, 5};
  const auto identity = Eigen::Affine3d::Identity();
  arm.document["skins"][0]["inverseBindMatrices"] = arm.data.add(
      Transforms{hipBind().inverse(), (hipBind() * Eigen::Translation3d(1, 0, 0)).inverse(), identity, identity});
  arm.animate("rise", 1, "translation", {0, 1, 0, 0, 2, 0});
  const auto folded = arm.read();
  CHECK(folded.rig.skeleton.jointCount() == 2);
  CHECK(folded.rig.skeleton.name(0) == "hip");
  CHECK(folded.animations.size() == 1);

  Arm flat;  // the knee beside the hip
  flat.document["nodes"][0]["children"] = {1, 2};
  flat.document["nodes"][1].erase("children");
  flat.document["nodes"][2] = {
      {"name", "knee"}, {"rotation", flat.document["nodes"][1]["rotation"]}, {"translation", {0, 2, 0}}};
  const auto spread = flat.read();
  REQUIRE(spread.rig.skeleton.jointCount() == 3);
  CHECK(spread.rig.skeleton.name(0) == "Armature");
  CHECK(spread.rig.skeleton.parent(2) == 0);
  CHECK(near(spread.rig.rest_joints.row(0), {0, 0, 1}));
  CHECK(near(spread.rig.rest_joints.row(2), {0, 0, 5}));
}

TEST_CASE("meshes of one skeleton follow each other, and those without a skin are left out by name") {
  Arm arm;
  const std::vector<std::uint16_t> joints(20, 0);
  std::vector<float> weights(20, 0);
  for (std::size_t v = 0; v < 5; ++v) weights[4 * v] = 0.8f;
  arm.document["meshes"].push_back(arm.mesh(joints, weights));
  arm.document["nodes"].push_back({{"name", "Coat"}, {"mesh", 1}, {"skin", 0}});
  auto plain = arm.document["meshes"][0];
  plain["name"] = "hat";
  plain["primitives"][0]["attributes"].erase("JOINTS_0");
  plain["primitives"][0]["attributes"].erase("WEIGHTS_0");
  arm.document["meshes"].push_back(plain);
  arm.document["nodes"].push_back({{"name", "Hat"}, {"mesh", 2}});
  arm.document["scenes"][0]["nodes"] = {0, 3, 4, 5};
  const auto read = arm.read();
  CHECK(read.vertices.rows() == 7);  // the coat weighs the place of two weights once
  CHECK(read.faces.rows() == 4);
  CHECK(read.largest_weight_change == Approx(0.2).epsilon(1e-6));
  CHECK(read.left_out == std::vector<std::string>{"hat"});

  arm.document["skins"].push_back(arm.document["skins"][0]);
  arm.document["skins"][1]["inverseBindMatrices"] = arm.data.add(Transforms{hipBind(), hipBind()});
  arm.document["nodes"][4]["skin"] = 1;
  checkRefused(arm, "is bound to joint 'hip' otherwise than a mesh before it");
}

TEST_CASE("a glTF file that makes no rig is refused with the reason") {
  const auto refused = [](auto change, const std::string& error) {
    Arm arm;
    change(arm);
    checkRefused(arm, error);
  };
  refused([](Arm& arm) { arm.document["nodes"][3].erase("skin"); }, "has no mesh with a skin and faces");
  refused(
      [](Arm& arm) {
        arm.document["nodes"][0]["scale"] = {2, 2, 3};
      },
      "joint 'hip' that mirrors, shears or scales");
  refused(
      [](Arm& arm) {
        arm.document["nodes"][0]["scale"] = {-2, 2, 2};
      },
      "joint 'hip' that mirrors, shears or scales");
  refused([](Arm& arm) { arm.document["nodes"][3]["name"] = "knee"; }, "has two nodes named 'knee', which is a joint");
  refused([](Arm& arm) { arm.document["meshes"][0]["primitives"][0]["mode"] = 1; }, "no triangle");
  refused(
      [](Arm& arm) {
        arm.document["meshes"][0] = arm.mesh(std::vector<std::uint16_t>(20, 0), std::vector<float>(20, 0));
      },
      "that no bone carries");
  refused(
      [](Arm& arm) {
        arm.document["meshes"][0] = arm.mesh(std::vector<std::uint16_t>(20, 0), std::vector<float>(20, std::nanf("")));
      },
      "arm.gltf");
  refused(
      [](Arm& arm) {
        const Eigen::Affine3d flat(Eigen::Scaling(1.0, 1.0, 0.0));
        arm.document["skins"][0]["inverseBindMatrices"] = arm.data.add(Transforms{flat, flat});
      },
      "joint 'hip' has an inverse bind matrix that is not finite or cannot be inverted");
  refused([](Arm& arm) { arm.document["asset"]["version"] = "7.0"; }, "is no glTF that can be read: ");

  const test::TemporaryFolder folder;
  CHECK_THROWS_WITH(readGltfRig(folder / "none.glb"), Contains("none.glb: cannot be opened"));
  CHECK_THROWS_WITH(readGltfRig(folder.file("a.obj", "v 0 0 0\n")), Contains("a.obj: is no binary glTF; want a file"));
  CHECK_THROWS_WITH(readGltfRig(folder.file("a.gltf", "{")), Contains("a.gltf: is no JSON"));
}

TEST_CASE("a glTF document that refers to what is not there is refused by the entry, before assimp follows it") {
  struct Case {
    const char* place;  // of what is replaced
    json value;         // null: nothing is there any more
    std::string error;
  };
  const std::vector<Case> cases{
      {"/scenes", nullptr, "has no scenes"},
      {"/scene", 1, "needs a whole number from 0 to 0 as scene"},
      {"/scenes/0/nodes/0", 4, "scenes[0] names nodes '4', outside [0, 4)"},
      {"/scenes/0/nodes/0", 1, "scenes[0] has node 1, which hangs on another"},
      {"/nodes/0/children/0", -1, "nodes[0] names children '-1', outside [0, 4)"},
      {"/nodes/0/children/0", 0, "nodes that hang on each other in a ring"},
      {"/nodes/3/children", json{2}, "nodes[3] has the child 2, which hangs on another"},
      {"/nodes/3/mesh", 1, "nodes[3] needs a whole number from 0 to 0 as mesh"},
      {"/nodes/3/skin", "a", "nodes[3] needs a whole number from 0 to 0 as skin"},
      {"/nodes/2", 7, "nodes[2] is no object"},
      {"/skins/0/joints", nullptr, "skins[0] has no joints"},
      {"/skins/0/inverseBindMatrices", nullptr, "skins[0] needs a whole number from 0 to 6 as inverseBindMatrices"},
      {"/skins/0/inverseBindMatrices", 0, "skins[0] needs MAT4 of floats for each of its joints"},
      {"/meshes/0/primitives", nullptr, "meshes[0] has no primitives"},
      {"/meshes/0/primitives/0/attributes", nullptr, "meshes[0].primitives[0] needs an object as attributes"},
      {"/meshes/0/primitives/0/attributes/POSITION", nullptr,
       "attributes needs a whole number from 0 to 6 as POSITION"},
      {"/meshes/0/primitives/0/attributes/POSITION", 2, "attributes needs VEC3 of floats as POSITION"},
      {"/meshes/0/primitives/0/attributes/JOINTS_0", 0, "attributes needs VEC4 as JOINTS_0"},
      {"/meshes/0/primitives/0/attributes/WEIGHTS_0", nullptr, "has JOINTS_0 without WEIGHTS_0"},
      {"/meshes/0/primitives/0/indices", 0, "meshes[0].primitives[0] needs SCALAR as indices"},
      {"/buffers/0/byteLength", 10, "reaches beyond its buffer"},
      {"/buffers/0/uri", nullptr, "buffers[0] has no uri and is longer than what follows"},
      {"/bufferViews/0/buffer", 1, "bufferViews[0] needs a whole number from 0 to 0 as buffer"},
      {"/bufferViews/0/byteLength", 100000, "bufferViews[0] reaches beyond its buffer"},
      {"/accessors/0/bufferView", nullptr, "accessors[0] needs a whole number from 0 to 6 as bufferView"},
      {"/accessors/0/count", 6, "accessors[0] reaches beyond its buffer view"},
      {"/accessors/0/componentType", 5124, "accessors[0] has a type that glTF does not know"},
      {"/accessors/0/type", "VEC5", "accessors[0] has a type that glTF does not know"},
      {"/accessors/0/sparse", 1, "accessors[0] is sparse, which is not understood"},
      {"/animations/0/samplers/0/input", nullptr,
       "animations[0].samplers[0] needs a whole number from 0 to 6 as input"},
      {"/animations/0/samplers/0/output", 5, "animations[0].channels[0].target has a path and values that do not fit"},
      {"/animations/0/channels/0/sampler", 1, "animations[0].channels[0] needs a whole number from 0 to 0 as sampler"},
      {"/animations/0/channels/0/target/node", nullptr, "channels[0].target needs a whole number from 0 to 3 as node"},
      {"/animations/0/channels/0/target/path", "colour", "target has a path and values that do not fit each other"},
      {"/extensionsRequired", json{"KHR_draco_mesh_compression"}, "requires the extension '\"KHR_draco_mesh_com"}};
  Arm arm;
  arm.animate("rise", 1, "translation", {0, 1, 0, 0, 2, 0});
  const test::TemporaryFolder folder;
  json sound = arm.document;
  arm.data.finish(sound);
  CHECK_NOTHROW(readGltfRig(folder.file("arm.gltf", sound.dump())));
  for (const auto& [place, value, error] : cases) {
    INFO(place << " = " << value);
    auto faulty = sound;
    const json::json_pointer pointer(place);
    if (value.is_null())
      faulty[pointer.parent_pointer()].erase(pointer.back());
    else
      faulty[pointer] = value;
    const auto file = folder.file("arm.gltf", faulty.dump());
    CHECK_THROWS_AS(readGltfRig(file), InvalidInput);
    CHECK_THROWS_WITH(readGltfRig(file), Contains("arm.gltf: ") && Contains(error));
  }
}

TEST_CASE("glTF options out of range are refused by name") {
  const auto violation = [](auto change) {
    GltfOptions options;
    change(options);
    return options.firstViolation().value_or("");
  };
  CHECK(violation([](auto&) {}).empty());
  CHECK(violation([](auto& options) { options.metres_per_unit = 0; }) == "metres_per_unit = 0, want a number above 0");
  CHECK(violation([](auto& options) { options.rate_hz = -1; }) == "rate_hz = -1, want a number above 0");
  CHECK(violation([](auto& options) { options.tolerance = -1; }) == "tolerance = -1, want a number >= 0");
}

TEST_CASE("a binary glTF file that was cut is refused") {
  const auto path = test::realData("gltf_ccby/Fox.glb");
  if (!path) return;
  const auto whole = test::bytesOf(*path);
  const test::TemporaryFolder folder;
  for (const std::size_t length : {4u, 11u, 12u, 19u, 20u, 100u, 20000u, 60000u, 100000u}) {
    INFO(length);
    REQUIRE(length < whole.size());
    CHECK_THROWS_AS(readGltfRig(folder.file("cut.glb", whole.substr(0, length))), InvalidInput);
  }
}
