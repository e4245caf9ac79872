#include <catch2/catch.hpp>
#include <numbers>

#include "core/io/amc.h"
#include "core/io/asf.h"
#include "core/io/bvh.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"
#include "tests/support/real_data.h"

using namespace shaped;
using Catch::Contains;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A leg of two bones; the shin's axes are turned.
const std::string kLeg = R"(# made by hand
:version 1.10
:name test
:units
  mass 1.0
  length 0.5
  angle deg
:documentation
   anything: here
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name thigh
     direction 0 -2 0
     length 3
     axis 0 0 0 XYZ
     dof rx ry rz
     limits (-160.0 20.0)
            (-70.0 70.0)
            (-60.0 70.0)
  end
  begin
     id 2
     name shin
     direction 0 0 1
     length 1
     axis 10 20 90 XYZ
     dof rz
     limits (-inf inf)
  end
  begin
     name toe
     direction 1 0 0
     length 0
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root thigh
    thigh shin
    shin toe
  end
)";

const std::string kStill = ":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\nthigh 0 0 0\nshin 0\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

PosedSkeleton posed(const MotionClip& clip, std::size_t frame) {
  return poseSkeleton(clip.skeleton, clip.rest_joints, clip.frames[frame]);
}

Eigen::Matrix3d about(const Eigen::Vector3d& axis, double degrees) { return rotationMatrix(axis * degrees * kDegree); }

}  // namespace

TEST_CASE("an ASF skeleton has its joints where bones begin, in metres") {
  const auto leg = parseAsf("a.asf", kLeg);
  REQUIRE(leg.skeleton.jointCount() == 4);
  const double unit = 0.0254 / 0.5;
  CHECK(leg.metres_per_unit == unit);
  CHECK(leg.skeleton.name(0) == "root");
  CHECK(leg.skeleton.name(2) == "shin");
  CHECK(leg.skeleton.parent(2) == 1);
  CHECK(leg.rest_joints.row(1).isZero(0));
  CHECK((leg.rest_joints.row(2) - Eigen::RowVector3d(0, -3 * unit, 0)).norm() < 1e-16);
  CHECK((leg.rest_joints.row(3) - Eigen::RowVector3d(0, -3 * unit, unit)).norm() < 1e-16);
  CHECK(leg.bone_ends.row(3) == leg.rest_joints.row(3));
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  CHECK((leg.bones[2].axes - about(z, 90) * about(y, 20) * about(x, 10)).norm() < 1e-15);
}

TEST_CASE("AMC angles turn bones about their own axes, the first angle innermost") {
  const auto leg = parseAsf("a.asf", kLeg);
  const auto clip = parseAmc("a.amc", kStill + "2\nshin 90\nthigh 10 20 30\nroot 1 2 3 40 50 60\n", leg, 60);
  CHECK(clip.rate_hz == 60);
  REQUIRE(clip.frames.size() == 2);
  CHECK((posed(clip, 0).joints - leg.rest_joints).norm() < 1e-16);
  const auto moved = posed(clip, 1);
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d root = about(z, 60) * about(y, 50) * about(x, 40),
                        thigh = root * about(z, 30) * about(y, 20) * about(x, 10),
                        shin = thigh * about(leg.bones[2].axes.col(2), 90);
  CHECK((moved.rotations[0] - root).norm() < 1e-14);
  CHECK((moved.rotations[1] - thigh).norm() < 1e-14);
  CHECK((moved.rotations[2] - shin).norm() < 1e-14);
  const double unit = leg.metres_per_unit;
  const Eigen::Vector3d hip = Eigen::Vector3d(1, 2, 3) * unit, knee = hip - thigh * y * 3 * unit,
                        ankle = knee + shin * z * unit;
  CHECK((moved.joints.row(1).transpose() - hip).norm() < 1e-15);
  CHECK((moved.joints.row(2).transpose() - knee).norm() < 1e-15);
  CHECK((moved.joints.row(3).transpose() - ankle).norm() < 1e-15);
}

TEST_CASE("angles are in the unit of the skeleton unless the motion says its own") {
  const auto in_radians = parseAsf("a.asf", replaced(kLeg, "angle deg", "angle rad"));
  const std::string frame = "1\nroot 0 0 0 1 0 0\nthigh 0 0 0\nshin 0\n";
  const auto turn = [&](const std::string& head) {
    return parseAmc("a.amc", head + frame, in_radians, 60).frames[0].rotations(0, 0);
  };
  CHECK(turn("") == Approx(1).epsilon(1e-15));
  CHECK(turn(":DEGREES\n") == Approx(kDegree).epsilon(1e-15));
  CHECK(turn(":RADIANS\n") == Approx(1).epsilon(1e-15));
}

TEST_CASE("faulty ASF files are refused with the line and the reason") {
  struct Case {
    std::string from, to, error;
  };
  const std::vector<Case> cases{
      {":version", "version", "a.asf:2: 'version' stands where a section"},
      {":units", ":unites", "the file has no :units with a length"},
      {":bonedata", ":bonedates", "there is no bone 'thigh' in :bonedata above"},
      {"length 0.5", "length 0", "a.asf:6: length must be above 0"},
      {"angle deg", "angle grad", "a.asf:7: angle is 'grad'; want deg or rad"},
      {"order TX", "order QX", "a.asf:11: bone 'root' may do 'QX'; want TX, TY"},
      {"order TX TY", "order TX TX", "a.asf:11: 'TX' occurs twice"},
      {"axis XYZ", "axis XYY", "a.asf:12: the order of the axes is 'XYY'; want XYZ"},
      {"RX RY RZ", "RZ RY RX", "the root turns in the order ZYX, and its axis says XYZ"},
      {"position 0 0 0", "position 0 0 1", "a.asf:13: the root's position is not 0 0 0"},
      {"orientation 0 0 0", "orientation 0 90 0", "a.asf:14: the root's orientation is not 0 0 0"},
      {"position 0 0 0", "place 0 0 0", "a.asf:13: 'place' is unknown; want order"},
      {":root\n   order TX TY TZ RX RY RZ\n", ":root\n", "the file has no :root with an order"},
      {"name thigh", "name root", "a.asf:26: the name 'root' occurs twice"},
      {"name shin", "name thigh", "a.asf:35: the name 'thigh' occurs twice"},
      {"     name toe\n", "", "a.asf:40: a bone has no name"},
      {"direction 0 -2 0", "direction 0 0 0", "a.asf:26: bone 'thigh' has a length and no direction"},
      {"direction 0 -2 0", "direction 0 inf 0", "a.asf:19: a direction of three numbers is not finite"},
      {"length 3", "length -3", "a.asf:20: a length is below 0"},
      {"dof rx ry rz", "dof rx ry tz", "a.asf:22: bone 'thigh' may do 'tz'; want rx, ry, rz: bones neither"},
      {"dof rx ry rz", "dof rx l", "a.asf:22: bone 'thigh' may do 'l'; want rx, ry, rz"},
      {"dof rz", "twist rz", "a.asf:33: 'twist' is unknown; want id, name"},
      {"root thigh", "hip thigh", "there is no bone 'hip' in :bonedata above"},
      {"shin toe", "shin foot", "there is no bone 'foot' in :bonedata above"},
      {"shin toe", "shin root", "the root hangs on 'shin'"},
      {"shin toe", "shin toe\n thigh toe", "bone 'toe' hangs on two"},
      {"    shin toe\n", "", "bone 'toe' hangs on nothing in :hierarchy"},
      {"root thigh", "toe thigh", "a.asf: has bones that hang on each other in a ring"}};
  for (const auto& [from, to, error] : cases) {
    INFO(from << " -> " << to);
    const auto text = replaced(kLeg, from, to);
    CHECK_THROWS_AS(parseAsf("a.asf", text), InvalidInput);
    CHECK_THROWS_WITH(parseAsf("a.asf", text), Contains(error));
  }
  for (std::size_t length = 0; length < kLeg.find("shin toe"); length += 11)
    CHECK_THROWS_AS(parseAsf("a.asf", kLeg.substr(0, length)), InvalidInput);
}

TEST_CASE("faulty AMC files are refused with the line and the reason") {
  const auto leg = parseAsf("a.asf", kLeg);
  struct Case {
    std::string from, to, error;
  };
  const std::vector<Case> cases{{"1\n", "", "a.amc:3: 'root' stands where the number of the first frame should"},
                                {"1\n", "1 2\n", "a.amc:3: the number of a frame stands alone"},
                                {"shin 0\n", "shin 0\n3\n", "a.amc:7: frame 3 follows frame 1; want one after"},
                                {"shin 0\n", "shin 0\n:DEGREES\n", "a.amc:7: ':DEGREES' stands within the frames"},
                                {"shin 0\n", "", "frame 1 ends without bone 'shin'"},
                                {"thigh 0 0 0\n", "thigh 0 0 0\nthigh 0 0 0\n", "a.amc:6: bone 'thigh' occurs twice"},
                                {"shin 0", "calf 0", "a.amc:6: the skeleton has no bone 'calf'"},
                                {"shin 0", "shin", "a.amc:6: nothing stands where an angle or position of each of 1"},
                                {"shin 0", "shin 0 0", "a.amc:6: bone 'shin' has more numbers than the 1"},
                                {"shin 0", "shin x", "a.amc:6: 'x' is not a number"},
                                {"shin 0", "shin nan", "a.amc:6: an angle or position is not finite"}};
  for (const auto& [from, to, error] : cases) {
    INFO(from << " -> " << to);
    const auto text = replaced(kStill, from, to);
    CHECK_THROWS_AS(parseAmc("a.amc", text, leg, 120), InvalidInput);
    CHECK_THROWS_WITH(parseAmc("a.amc", text, leg, 120), Contains(error));
  }
  CHECK_THROWS_WITH(parseAmc("a.amc", ":DEGREES\n", leg, 120), Contains("there are no frames"));
  CHECK_THROWS_WITH(parseAmc("a.amc", kStill, leg, 0), Contains("rate_hz: is 0, want"));
}

TEST_CASE("CMU's clip 01_01 is the same motion as ASF/AMC and as BVH") {
  const auto asf = test::realData("cmu_mocap/asfamc/01/01.asf"), amc = test::realData("cmu_mocap/asfamc/01/01_01.amc"),
             bvh = test::realData("cmu_mocap/bvh/01_01.bvh");
  if (!asf || !amc || !bvh) return;
  const auto skeleton = readAsf(*asf);
  const auto original = readAmc(*amc, skeleton, 120), converted = readBvh(*bvh, skeleton.metres_per_unit);
  CHECK(original.frames.size() == 2751);
  CHECK(converted.frames.size() == 2752);  // the conversion has a T pose before the first frame
  REQUIRE(converted.skeleton.jointCount() == 31);
  for (std::int32_t j = 0; j < 31; ++j) REQUIRE(converted.skeleton.parent(j) == original.skeleton.parent(j));
  const std::int32_t neck = *original.skeleton.find("lowerneck");
  double rotations_apart = 0, joints_apart = 0;
  for (std::size_t f = 0; f < original.frames.size(); f += 50) {
    const auto one = posed(original, f), other = posed(converted, f + 1);
    for (std::int32_t j = 0; j < 31; ++j)
      rotations_apart =
          std::max(rotations_apart,
                   (one.rotations[static_cast<std::size_t>(j)] - other.rotations[static_cast<std::size_t>(j)]).norm());
    // The conversion leaves out the length of the thorax: from the neck on joints stand 0.117 m lower.
    joints_apart =
        std::max(joints_apart, (one.joints.topRows(neck) - other.joints.topRows(neck)).rowwise().norm().maxCoeff());
  }
  CHECK(rotations_apart < 1e-4);  // BVH rounds angles to 1e-4 degrees
  CHECK(joints_apart < 2e-5);
}

TEST_CASE("every CMU motion in Acclaim's format is read whole") {
  const std::vector<std::pair<const char*, std::size_t>> clips{
      {"01/01_08", 2610}, {"02/02_01", 343}, {"02/02_03", 173}, {"02/02_10", 2645}, {"03/03_02", 365}};
  for (const auto& [name, frames] : clips) {
    const std::string stem = std::string("cmu_mocap/asfamc/") + name;
    const auto amc = test::realData(stem + ".amc"), asf = test::realData(stem.substr(0, stem.rfind('_')) + ".asf");
    if (!amc || !asf) return;
    INFO(name);
    const auto skeleton = readAsf(*asf);
    const auto clip = readAmc(*amc, skeleton, 120);
    CHECK(clip.frames.size() == frames);
    CHECK(clip.skeleton.jointCount() == 31);
    const auto height = skeleton.bone_ends.col(1).maxCoeff() - skeleton.bone_ends.col(1).minCoeff();
    CHECK(height > 1.4);
    CHECK(height < 2);
    const auto placed = posed(clip, frames / 2).joints;
    for (std::int32_t j = 1; j < 31; ++j) {
      const auto parent = clip.skeleton.parent(j);
      CHECK((placed.row(j) - placed.row(parent)).norm() ==
            Approx((clip.rest_joints.row(j) - clip.rest_joints.row(parent)).norm()).margin(1e-14));
    }
  }
}
