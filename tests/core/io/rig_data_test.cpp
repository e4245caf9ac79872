// The rigs of the real data sets, by way of tests/support/rig_from_data.py.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/io/rig_file.h"
#include "tests/support/literal_skinning.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;

namespace {

RigFile converted(const std::string& arguments, std::int32_t vertex_count) {
  const test::TemporaryFolder folder;
  const auto file = folder / "rig.json";
  const std::string command =
      std::string("/usr/bin/python3 ") + SHAPED_SOURCE + "/tests/support/rig_from_data.py " + arguments;
  const auto placed = [&] {  // the file's name stands where the arguments say OUT
    auto text = command;
    return text.replace(text.find("OUT"), 3, file.string());
  }();
  INFO(placed);
  REQUIRE(std::system(placed.c_str()) == 0);
  return readRig(file, vertex_count);
}

}  // namespace

TEST_CASE("the real rig, read and posed by its joint angles, gives the posed bodies") {
  const auto folder = test::realData("posed_body");
  if (!folder) return;
  const auto [rig, change] = converted("posed_body " + folder->string() + " OUT 1k", 1250);
  CHECK(change < 1e-6);
  const auto body = readMesh(*folder / "coarse_1k/template.ply").vertices;
  const auto angles = readNpy(*folder / "full/local_rotvec_f32.npy", std::array<std::int64_t, 3>{72, 31, 3});
  const auto poses = readNpy(*folder / "coarse_1k/poses_f32.npy", std::array<std::int64_t, 3>{72, 1250, 3});
  double worst = 0;
  for (std::size_t k = 0; k < 72; k += 5) {
    Pose pose = restPose(rig.skeleton);
    pose.rotations = Eigen::Map<const Vertices>(angles.values.data() + k * 93, 31, 3);
    const Eigen::Map<const Vertices> expected(poses.values.data() + k * 3750, 1250, 3);
    worst = std::max(worst, (test::skinLiterally(rig, body, pose) - expected).rowwise().norm().maxCoeff());
  }
  // joints are given to 1e-6 m a bone, vertices to 4e-6 m
  CHECK(worst < 2e-5);
}

TEST_CASE("the rigs of MakeHuman and of other bodies are read whole") {
  const auto makehuman = test::realData("makehuman_cc0"), sequences = test::realData("body_sequences"),
             posed = test::realData("posed_body");
  if (!makehuman || !sequences || !posed) return;
  const auto standard = converted("makehuman " + makehuman->string() + " default OUT", 13380);
  CHECK(standard.rig.skeleton.jointCount() == 163);
  CHECK(standard.largest_weight_change == Approx(0.063).margin(5e-4));  // the data set says: sums of 0.954 to 1.063
  const auto cmu = converted("makehuman " + makehuman->string() + " cmu_mb OUT", 13380);
  CHECK(cmu.rig.skeleton.jointCount() == 31);
  CHECK(cmu.rig.skeleton.name(0) == "Hips");
  CHECK(cmu.rig.rest_joints(*cmu.rig.skeleton.find("Head"), 1) == Approx(0.697495).margin(1e-9));
  CHECK(converted("makehuman " + makehuman->string() + " game_engine OUT", 13380).rig.skeleton.jointCount() == 53);
  const auto child = converted("body_sequences " + sequences->string() + " child " + posed->string() + " OUT", 1250);
  CHECK(child.rig.skeleton.jointCount() == 31);
}
