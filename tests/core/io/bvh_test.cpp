#include "core/io/bvh.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "core/io/motion_channel.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Two joints; the child has its own channels.
std::string arm(const std::string& child_channels, const std::string& rows, const std::string& frames = "1") {
  return "HIERARCHY\nROOT hip\n{\n\tOFFSET 1 2 3\n\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
         "Xrotation\n\tJOINT the knee {\n\t\tOFFSET 0 -2 0\n\t\t" +
         child_channels + "\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 -1 0\n\t\t}\n\t}\n}\nMOTION\nFrames: " + frames +
         "\nFrame Time: .0083333\n" + rows;
}

Vertices joints(const MotionClip& clip, std::size_t frame) {
  return poseSkeleton(clip.skeleton, clip.rest_joints, clip.frames[frame]).joints;
}

double largestBoneChange(const MotionClip& clip) {
  double change = 0;
  for (std::size_t f = 0; f < clip.frames.size(); f += 1 + clip.frames.size() / 20) {
    const auto placed = joints(clip, f);
    for (std::int32_t j = 1; j < clip.skeleton.jointCount(); ++j) {
      const auto parent = clip.skeleton.parent(j);
      change = std::max(change, std::abs((placed.row(j) - placed.row(parent)).norm() -
                                         (clip.rest_joints.row(j) - clip.rest_joints.row(parent)).norm()));
    }
  }
  return change;
}

}  // namespace

TEST_CASE("a BVH joint stands where its channels say, in metres") {
  const auto clip = parseBvh(
      "a.bvh", arm("CHANNELS 3 Zrotation Xrotation Yrotation", "1 2 3 0 0 0 0 0 0\n5 6 7 90 0 0 0 0 0\n", "2"), 0.5);
  REQUIRE(clip.skeleton.jointCount() == 2);
  CHECK(clip.skeleton.name(1) == "the knee");
  CHECK(clip.rate_hz == 120);
  CHECK(clip.rest_joints.row(0) == Eigen::RowVector3d(0.5, 1, 1.5));
  CHECK(clip.rest_joints.row(1) == Eigen::RowVector3d(0.5, 0, 1.5));
  CHECK(joints(clip, 0) == clip.rest_joints);
  const auto turned = joints(clip, 1);  // a quarter turn about z brings -y to +x
  CHECK((turned.row(0) - Eigen::RowVector3d(2.5, 3, 3.5)).norm() < 1e-15);
  CHECK((turned.row(1) - Eigen::RowVector3d(3.5, 3, 3.5)).norm() < 1e-15);
}

TEST_CASE("BVH rotations follow each other in the order of the channels, which any joint may have its own") {
  const auto row = [](const std::string& child) { return "1 2 3 10 20 30 " + child + "\n"; };
  const auto turn = [](int axis, double degrees) { return axisTurn(axis, degrees * kDegree); };
  const auto rotation = [](const std::string& channels, const std::string& rows, Eigen::Index joint) {
    const auto clip = parseBvh("a.bvh", arm(channels, rows), 1);
    return rotationMatrix(clip.frames[0].rotations.row(joint).transpose());
  };
  const auto near = [](const Eigen::Matrix3d& one, const Eigen::Matrix3d& other) {
    return (one - other).norm() < 1e-14;
  };
  CHECK(near(rotation("CHANNELS 3 Zrotation Xrotation Yrotation", row("40 50 60"), 0),
             turn(2, 10) * turn(1, 20) * turn(0, 30)));
  CHECK(near(rotation("CHANNELS 3 Zrotation Xrotation Yrotation", row("40 50 60"), 1),
             turn(2, 40) * turn(0, 50) * turn(1, 60)));
  CHECK(near(rotation("CHANNELS 3 xROTATION Zrotation Xrotation", row("40 50 60"), 1),
             turn(0, 40) * turn(2, 50) * turn(0, 60)));
  CHECK(near(rotation("CHANNELS 1 Yrotation", row("40"), 1), turn(1, 40)));
  CHECK(near(rotation("CHANNELS 0", row(""), 1), Eigen::Matrix3d::Identity()));
  // positions may stand between them
  CHECK(near(
      rotation("CHANNELS 6 Zrotation Xposition Xrotation Yposition Zposition Yrotation", row("40 0 50 -2 0 60"), 1),
      turn(2, 40) * turn(0, 50) * turn(1, 60)));
}

TEST_CASE("a BVH joint other than the root stays at its offset or at no shift from it, or is refused") {
  const std::string six = "CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation";
  const auto read = [&](const std::string& rows) { return parseBvh("a.bvh", arm(six, rows, "2"), 1); };
  const std::string root = "1 2 3 0 0 0 ", still = " 0 0 0\n";
  const auto at = [&](const std::string& position) { return root + position + still; };
  CHECK(joints(read(at("0 -2 0") + at("0.001 -2.001 0")), 1) == read(at("0 0 0") + at("0 0.001 0")).rest_joints);
  CHECK_THROWS_WITH(read(at("0 -2 0") + at("0 -2.1 0")), Contains("a.bvh:19: joint 'the knee' moves") &&
                                                             Contains("from its place in frame 1; only the root may"));
  CHECK_THROWS_AS(read(at("0 0 0") + at("0 -2 0")), InvalidInput);
  CHECK_THROWS_AS(read(at("0 -2 0") + at("0 0 0")), InvalidInput);
  CHECK_THROWS_WITH(read(at("5 0 0") + at("5 0 0")), Contains("a.bvh:18: joint 'the knee' moves 5 away"));
}

TEST_CASE("faulty BVH files are refused with the line and the reason") {
  const std::string sound = arm("CHANNELS 1 Xrotation", "1 2 3 0 0 0 10\n");
  CHECK_NOTHROW(parseBvh("a.bvh", sound, 1));
  struct Case {
    std::string from, to, error;
  };
  const std::vector<Case> cases{
      {"HIERARCHY", "HIERARCHIE", "a.bvh:1: a BVH file begins with HIERARCHY"},
      {"ROOT hip\n{", "ROOT\n{", "a.bvh:2: a joint has no name"},
      {"ROOT hip", "JOINT hip", "a.bvh:2: a JOINT before there is a ROOT"},
      {"JOINT the knee", "ROOT the knee", "a.bvh:6: a second ROOT"},
      {"JOINT the knee", "JOINT hip", "a.bvh:6: the name 'hip' occurs twice"},
      {"JOINT the knee {", "JOINT the knee\nOFFSET", "a.bvh:7: 'OFFSET' stands where { should"},
      {"OFFSET 0 -2 0", "OFFSET 0 -2", "a.bvh:7: nothing stands where an OFFSET of three numbers should"},
      {"OFFSET 0 -2 0", "OFFSET 0 -2 inf", "a.bvh:7: the OFFSET is not finite"},
      {"OFFSET 0 -2 0", "OFFSET 0 -2 0 1", "a.bvh:7: '1' is more than the line should hold"},
      {"OFFSET 0 -2 0", "OFFSET 0 -2 0\nOFFSET 0 0 0", "a.bvh:8: a second OFFSET"},
      {"OFFSET 0 -2 0", "", "a.bvh:13: a joint or End Site closes without an OFFSET"},
      {"OFFSET 0 -2 0", "SCALE 1", "a.bvh:7: 'SCALE' is unknown; want JOINT"},
      {"CHANNELS 1", "CHANNELS 7", "a.bvh:8: a joint has 7 channels; want 0 to 6"},
      {"CHANNELS 1 X", "CHANNELS 2 X", "a.bvh:8: '' is no channel; want Xposition"},
      {"1 Xrotation", "1 Wrotation", "a.bvh:8: 'Wrotation' is no channel; want Xposition"},
      {"1 Xrotation", "2 Xposition Xposition", "a.bvh:8: the channel 'Xposition' occurs twice"},
      {"1 Xrotation", "1 Xrotation\nCHANNELS 1 Yrotation", "a.bvh:9: CHANNELS that no joint needs"},
      {"\t}\n}\n", "\t}\n", "a.bvh:14: MOTION begins before every { has its }"},
      {"\t}\n}\n", "\t}\n}\n}\n", "a.bvh:15: '}' stands outside of a joint"},
      {"MOTION", "", "a.bvh:16: 'Frames:' stands outside of a joint; want ROOT or MOTION"},
      {"Frames: 1", "Frame: 1", "a.bvh:16: 'Frame: 1' stands where 'Frames:' should"},
      {"Frames: 1", "Frames: x", "a.bvh:16: 'x' is not a whole number"},
      {"Frames: 1", "Frames: 2", "a.bvh: promises 2 frames, but 1 are there"},
      {"Frames: 1", "Frames: 0", "a.bvh: promises 0 frames, but 1 are there"},
      {".0083333", "0", "a.bvh:17: the frame time is 0 s; want one above 0"},
      {"1 2 3 0 0 0 10", "1 2 3 0 0 0", "a.bvh:18: has fewer numbers than the 7 channels"},
      {"1 2 3 0 0 0 10", "1 2 3 0 0 0 10 11", "a.bvh:18: has more numbers than the 7 channels"},
      {"1 2 3 0 0 0 10", "1 2 3 0 0 0 ten", "a.bvh:18: 'ten' is not a number"},
      {"1 2 3 0 0 0 10", "1 2 3 0 0 0 nan", "a.bvh:18: 'nan' is not finite"}};
  for (const auto& [from, to, error] : cases) {
    INFO(from << " -> " << to);
    auto text = sound;
    text.replace(text.find(from), from.size(), to);
    CHECK_THROWS_AS(parseBvh("a.bvh", text, 1), InvalidInput);
    CHECK_THROWS_WITH(parseBvh("a.bvh", text, 1), Contains(error));
  }
  CHECK_THROWS_AS(parseBvh("a.bvh", "", 1), InvalidInput);
  for (std::size_t length = 1; length < sound.size() - 16; length += 7)
    CHECK_THROWS_AS(parseBvh("a.bvh", sound.substr(0, length), 1), InvalidInput);
  for (const double unit : {0.0, -1.0, std::nan("")})
    CHECK_THROWS_WITH(parseBvh("a.bvh", sound, unit), Contains("metres_per_unit: is"));
}

TEST_CASE("a motion written as BVH reads back, also at right angles") {
  const test::TemporaryFolder folder;
  // children out of depth-first order: c hangs on a, after b
  MotionClip clip{Skeleton({{"a", -1}, {"b", 0}, {"c", 0}, {"d", 1}}), Vertices::Random(4, 3), 29.97, {}};
  for (int f = 0; f < 40; ++f) {
    Pose pose{Eigen::Vector3d::Random(), Vertices::Random(4, 3) * 3};
    pose.rotations.row(1) = Eigen::RowVector3d(0, std::numbers::pi / 2 + std::pow(0.1, f / 2) * (f % 2), 0);
    clip.frames.push_back(pose);
  }
  writeBvh(folder / "a.bvh", clip, 0.01);
  const auto back = readBvh(folder / "a.bvh", 0.01);
  CHECK(back.rate_hz == Approx(29.97).epsilon(1e-15));
  REQUIRE(back.frames.size() == 40);
  const std::vector<std::int32_t> order{0, 1, 3, 2};
  double apart = 0;
  for (std::size_t f = 0; f < 40; ++f) {
    const auto was = poseSkeleton(clip.skeleton, clip.rest_joints, clip.frames[f]),
               is = poseSkeleton(back.skeleton, back.rest_joints, back.frames[f]);
    for (std::int32_t j = 0; j < 4; ++j) {
      const auto old = order[static_cast<std::size_t>(j)];
      CHECK(back.skeleton.name(j) == clip.skeleton.name(old));
      apart = std::max(apart, (is.joints.row(j) - was.joints.row(old)).norm());
      apart = std::max(
          apart, (is.rotations[static_cast<std::size_t>(j)] - was.rotations[static_cast<std::size_t>(old)]).norm());
    }
  }
  CHECK(apart < 1e-13);
}

TEST_CASE("a motion that BVH cannot hold is not written") {
  const test::TemporaryFolder folder;
  const Skeleton one({{"a", -1}});
  const MotionClip sound{one, Vertices::Zero(1, 3), 30, {restPose(one)}};
  const auto refused = [&](auto change, const std::string& error) {
    auto clip = sound;
    change(clip);
    CHECK_THROWS_WITH(writeBvh(folder / "a.bvh", clip, 1), Contains(error));
  };
  refused([](auto& clip) { clip.frames.clear(); }, "frames: is empty");
  refused([](auto& clip) { clip.rate_hz = 0; }, "rate_hz: is 0, want");
  refused([](auto& clip) { clip.frames[0].rotations.resize(2, 3); }, "pose.rotations: has 2 rows");
  refused([](auto& clip) { clip.skeleton = Skeleton({{"a{", -1}}); }, "joints[0]: has a name that BVH cannot hold");
  CHECK_THROWS_WITH(writeBvh(folder / "a.bvh", sound, 0), Contains("metres_per_unit: is 0"));
  CHECK_FALSE(std::filesystem::exists(folder / "a.bvh"));
}

TEST_CASE("real BVH clips are read whole: both CMU dialects and MakeHuman's") {
  struct Clip {
    const char* file;
    double metres;
    std::int32_t joints;
    std::size_t frames;
    double rate;
  };
  const double cmu = 0.0254 / 0.45, dm = 0.1;
  const std::vector<Clip> clips{{"cmu_mocap/bvh/01_01.bvh", cmu, 31, 2752, 120},
                                {"cmu_mocap/bvh/131_01.bvh", cmu, 31, 994, 120},
                                {"cmu_mocap/bvh/cmu_12_01_walk.bvh", cmu, 31, 524, 120},
                                {"makehuman_cc0/poses/tpose.bvh", dm, 173, 1, 24},
                                {"makehuman_cc0/poses/benchmark.bvh", dm, 163, 1, 24},
                                {"makehuman_cc0/poseunits/face-poseunits.bvh", dm, 163, 60, 24},
                                {"makehuman_cc0/animations/walks/walk1.bvh", dm, 75, 14, 24},
                                {"makehuman_cc0/animations/zombie/zombieWalk1.bvh", dm, 75, 31, 24}};
  for (const auto& [file, metres, joint_count, frames, rate] : clips) {
    const auto path = test::realData(file);
    if (!path) return;
    INFO(file);
    const auto clip = readBvh(*path, metres);
    CHECK(clip.skeleton.jointCount() == joint_count);
    CHECK(clip.frames.size() == frames);
    CHECK(clip.rate_hz == rate);
    CHECK(largestBoneChange(clip) < 1e-14);
    const Eigen::RowVector3d size = clip.rest_joints.colwise().maxCoeff() - clip.rest_joints.colwise().minCoeff();
    CHECK(size.maxCoeff() > 1.2);
    CHECK(size.maxCoeff() < 2.2);
  }
}
