#include "core/io/bvh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/io/bvh_hierarchy.h"
#include "core/io/file.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// What follows the label in a line such as "Frame Time: 0.0083".
std::string_view labelled(TextScanner& scanner, std::string_view label) {
  if (!scanner.nextContentLine('\0')) scanner.fail("the file ends before '" + std::string(label) + "'");
  const auto line = scanner.fields('\0').front();
  if (!line.starts_with(label)) scanner.fail(quotedWord(line) + " stands where '" + std::string(label) + "' should");
  auto value = line.substr(label.size());
  while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
  return value;
}

double readRate(TextScanner& scanner) {
  const double seconds = scanner.numberIn(labelled(scanner, "Frame Time:"), "the frame time");
  const double rate = 1 / seconds;
  if (!(seconds > 0) || !std::isfinite(seconds) || !std::isfinite(rate))
    scanner.fail("the frame time is " + shortest(seconds) + " s; want one above 0");
  const double whole = std::round(rate);
  return std::abs(rate - whole) <= 1e-4 * rate ? whole : rate;
}

Skeleton skeletonOf(const std::vector<BvhJoint>& joints) {
  std::vector<Joint> tree;
  for (const auto& joint : joints) tree.push_back({joint.name, joint.parent});
  return Skeleton(std::move(tree));
}

/// Where the joints lie at rest, in the file's unit.
Vertices restJoints(const TextScanner& scanner, const std::vector<BvhJoint>& joints) {
  Vertices rest(joints.size(), 3);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    rest.row(row) = joints[j].offset;
    if (joints[j].parent >= 0) rest.row(row) += rest.row(joints[j].parent);
    if (!rest.row(row).allFinite()) scanner.fail("the OFFSETs up to joint " + quotedWord(joints[j].name) + " overflow");
  }
  return rest;
}

/// Reads the rows of numbers, one a frame.
class FrameReader {
 public:
  FrameReader(TextScanner& scanner, const std::vector<BvhJoint>& joints, double metres)
      : scanner_(scanner), joints_(joints), metres_(metres), at_offset_(joints.size(), true) {
    for (const auto& joint : joints) {
      channels_ += joint.channels.size();
      tolerance_ = std::max(tolerance_, 1e-3 * joint.offset.norm());
    }
    if (channels_ == 0) scanner.fail("no joint has channels: there is no motion");
  }

  /// The pose of the scanner's current line.
  Pose read() {
    Pose pose{Eigen::Vector3d::Zero(), Vertices(joints_.size(), 3)};
    for (std::size_t j = 0; j < joints_.size(); ++j) readJoint(j, pose);
    if (!scanner_.word().empty())
      scanner_.fail("has more numbers than the " + std::to_string(channels_) + " channels of a frame");
    ++frame_;
    return pose;
  }

 private:
  double number() {
    const auto word = scanner_.word();
    if (word.empty()) scanner_.fail("has fewer numbers than the " + std::to_string(channels_) + " channels of a frame");
    const double value = scanner_.numberIn(word, "an angle or position");
    if (!std::isfinite(value)) scanner_.fail(quotedWord(word) + " is not finite");
    return value;
  }

  void readJoint(std::size_t j, Pose& pose) {
    const BvhJoint& joint = joints_[j];
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::RowVector3d position = joint.offset;
    bool placed = false;
    for (const auto& channel : joint.channels) {
      const double value = number();
      placed = placed || !channel.turns;
      if (channel.turns)
        rotation *= axisTurn(channel.axis, value * kDegree);
      else
        position[channel.axis] = value;
    }
    pose.rotations.row(static_cast<Eigen::Index>(j)) = axisAngle(rotation).transpose();
    if (placed && j > 0) requireStill(j, position);
    if (j > 0) return;
    pose.translation = metres_ * (position - joint.offset).transpose();
    if (!pose.translation.allFinite()) scanner_.fail("the root's position overflows");
  }

  void requireStill(std::size_t j, const Eigen::RowVector3d& position) {
    const auto& offset = joints_[j].offset;
    if (frame_ == 0) at_offset_[j] = (position - offset).norm() <= position.norm();
    const double away = at_offset_[j] ? (position - offset).norm() : position.norm();
    if (away > tolerance_)
      scanner_.fail("joint " + quotedWord(joints_[j].name) + " moves " + shortest(away) +
                    " away from its place in frame " + std::to_string(frame_) + "; only the root may");
  }

  TextScanner& scanner_;
  const std::vector<BvhJoint>& joints_;
  double metres_, tolerance_ = 0;
  std::vector<bool> at_offset_;  ///< or else at 0: how the first frame says that a joint stays
  std::size_t channels_ = 0, frame_ = 0;
};

}  // namespace

MotionClip parseBvh(const std::string& file, std::string_view text, double metres_per_unit) {
  if (!(metres_per_unit > 0) || !std::isfinite(metres_per_unit))
    throw InvalidInput("metres_per_unit", "is " + shortest(metres_per_unit) + ", want a number above 0");
  TextScanner scanner(file, text);
  const auto joints = readBvhHierarchy(scanner);
  const auto promised = scanner.integerIn(labelled(scanner, "Frames:"), "the number of frames");
  const double rate = readRate(scanner);
  MotionClip clip{skeletonOf(joints), restJoints(scanner, joints) * metres_per_unit, rate, {}};
  if (!clip.rest_joints.allFinite()) throw InvalidInput(file, "has OFFSETs that overflow in metres");
  FrameReader frames(scanner, joints, metres_per_unit);
  while (scanner.nextContentLine('\0')) {
    clip.frames.push_back(frames.read());
    requireFilledFrames(scanner, clip.frames.size(), joints.size(), text.size());
  }
  if (promised < 1 || static_cast<std::int64_t>(clip.frames.size()) != promised)
    throw InvalidInput(file, "promises " + std::to_string(promised) + " frames, but " +
                                 std::to_string(clip.frames.size()) + " are there; want as many, and at least 1");
  return clip;
}

MotionClip readBvh(const std::filesystem::path& path, double metres_per_unit) {
  return parseBvh(path.string(), readFile(path), metres_per_unit);
}

}  // namespace shaped
