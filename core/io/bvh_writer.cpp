#include <cmath>
#include <numbers>
#include <ranges>

#include "core/io/bvh.h"
#include "core/io/file.h"
#include "core/io/motion_channel.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

void requireWritable(const MotionClip& clip, double metres_per_unit) {
  if (clip.frames.empty()) throw InvalidInput("frames", "is empty, want at least one");
  if (!(clip.rate_hz > 0) || !std::isfinite(clip.rate_hz))
    throw InvalidInput("rate_hz", "is " + shortest(clip.rate_hz) + ", want a number above 0");
  if (!(metres_per_unit > 0) || !std::isfinite(metres_per_unit))
    throw InvalidInput("metres_per_unit", "is " + shortest(metres_per_unit) + ", want a number above 0");
  for (std::int32_t j = 0; j < clip.skeleton.jointCount(); ++j) {
    const auto& name = clip.skeleton.name(j);
    const std::string_view blanks(" \t\0", 3);
    if (name.find_first_of(std::string_view("\r\n{}\0", 5)) != std::string::npos ||
        blanks.find(name.front()) != std::string_view::npos || blanks.find(name.back()) != std::string_view::npos)
      throw InvalidInput("joints[" + std::to_string(j) + "]",
                         "has a name that BVH cannot hold: " + quotedWord(name) +
                             "; want one without line ends, braces or blanks around it");
  }
}

/// Joints in the order in which the file nests them, with how deep each stands.
struct Nested {
  std::int32_t joint, depth;
};

std::vector<Nested> depthFirst(const Skeleton& skeleton) {
  std::vector<std::vector<std::int32_t>> children(static_cast<std::size_t>(skeleton.jointCount()));
  for (std::int32_t j = 1; j < skeleton.jointCount(); ++j)
    children[static_cast<std::size_t>(skeleton.parent(j))].push_back(j);
  std::vector<Nested> order, waiting{{0, 0}};
  while (!waiting.empty()) {
    const auto next = waiting.back();
    waiting.pop_back();
    order.push_back(next);
    const auto& below = children[static_cast<std::size_t>(next.joint)];
    for (const auto child : std::views::reverse(below)) waiting.push_back({child, next.depth + 1});
  }
  return order;
}

std::string line(std::int32_t depth, const std::string& text) {
  return std::string(static_cast<std::size_t>(depth), '\t') + text + "\n";
}

std::string numbers(const Eigen::RowVector3d& values) {
  return shortest(values[0]) + " " + shortest(values[1]) + " " + shortest(values[2]);
}

/// One joint up to where its children follow.
std::string formatJoint(const MotionClip& clip, Nested nested, double metres) {
  const auto [j, depth] = nested;
  const auto parent = clip.skeleton.parent(j);
  const Eigen::RowVector3d rest = clip.rest_joints.row(j),
                           from = parent < 0 ? Eigen::RowVector3d::Zero()
                                             : Eigen::RowVector3d(clip.rest_joints.row(parent));
  return line(depth, (parent < 0 ? "ROOT " : "JOINT ") + clip.skeleton.name(j)) + line(depth, "{") +
         line(depth + 1, "OFFSET " + numbers((rest - from) / metres)) +
         line(depth + 1, parent < 0 ? "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation"
                                    : "CHANNELS 3 Zrotation Yrotation Xrotation");
}

std::string formatHierarchy(const MotionClip& clip, const std::vector<Nested>& order, double metres) {
  std::string text = "HIERARCHY\n";
  for (std::size_t i = 0; i < order.size(); ++i) {
    text += formatJoint(clip, order[i], metres);
    const auto depth = order[i].depth, next = i + 1 < order.size() ? order[i + 1].depth : 0;
    if (next <= depth)  // a leaf, which the format ends with an end site
      text +=
          line(depth + 1, "End Site") + line(depth + 1, "{") + line(depth + 2, "OFFSET 0 0 0") + line(depth + 1, "}");
    for (auto open = depth; open >= next; --open) text += line(open, "}");
  }
  return text;
}

/// Angles z, y, x in degrees with Rz Ry Rx = rotation. Taken one after the other from what the ones before leave over,
/// they fit together also where y is near a right angle and z and x are hardly told apart.
Eigen::RowVector3d eulerZyx(const Eigen::Matrix3d& rotation) {
  const double z = std::atan2(rotation(1, 0), rotation(0, 0));
  const Eigen::Matrix3d left = axisTurn(2, -z) * rotation;
  return Eigen::RowVector3d(z, std::atan2(-left(2, 0), left(0, 0)), std::atan2(-left(1, 2), left(1, 1))) / kDegree;
}

std::string formatFrame(const MotionClip& clip, const Pose& pose, const std::vector<Nested>& order, double metres) {
  std::string text = numbers((clip.rest_joints.row(0) + pose.translation.transpose()) / metres);
  for (const auto& [joint, depth] : order)
    text += " " + numbers(eulerZyx(rotationMatrix(pose.rotations.row(joint).transpose())));
  return text + "\n";
}

}  // namespace

void writeBvh(const std::filesystem::path& path, const MotionClip& clip, double metres_per_unit) {
  requireWritable(clip, metres_per_unit);
  const auto order = depthFirst(clip.skeleton);
  FileWriter writer(path);
  writer.write(formatHierarchy(clip, order, metres_per_unit));
  writer.write("MOTION\nFrames: " + std::to_string(clip.frames.size()) + "\nFrame Time: " + shortest(1 / clip.rate_hz) +
               "\n");
  for (const auto& pose : clip.frames) {
    poseSkeleton(clip.skeleton, clip.rest_joints, pose);  // throws unless the pose fits
    writer.write(formatFrame(clip, pose, order, metres_per_unit));
  }
  writer.commit();
}

}  // namespace shaped
