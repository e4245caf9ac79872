#include "core/io/amc.h"

#include <cmath>
#include <map>
#include <numbers>

#include "core/io/file.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

class AmcReader {
 public:
  AmcReader(const std::string& file, std::string_view text, const AcclaimSkeleton& skeleton)
      : scanner_(file, text), bytes_(text.size()), skeleton_(skeleton), radians_(skeleton.radians_per_unit) {
    for (std::int32_t j = 0; j < skeleton.skeleton.jointCount(); ++j) joints_[skeleton.skeleton.name(j)] = j;
  }

  std::vector<Pose> read() {
    while (scanner_.nextContentLine('#')) {
      const auto word = scanner_.word();
      std::int64_t number = 0;
      if (word.starts_with(":"))
        readKeyword(word);
      else if (parseInteger(word, number))
        beginFrame(number);
      else
        readBone(word);
    }
    if (frames_.empty()) scanner_.fail("there are no frames");
    requireWholeFrame();
    return std::move(frames_);
  }

 private:
  void readKeyword(std::string_view word) {
    if (!frames_.empty()) scanner_.fail(quotedWord(word) + " stands within the frames");
    if (word == ":DEGREES") radians_ = std::numbers::pi / 180;
    if (word == ":RADIANS") radians_ = 1;
  }

  void beginFrame(std::int64_t number) {
    if (!frames_.empty() && number - 1 != number_)
      scanner_.fail("frame " + std::to_string(number) + " follows frame " + std::to_string(number_) +
                    "; want one after the other");
    if (!scanner_.word().empty()) scanner_.fail("the number of a frame stands alone on its line");
    if (!frames_.empty()) requireWholeFrame();
    number_ = number;
    frames_.push_back(restPose(skeleton_.skeleton));
    seen_.assign(skeleton_.bones.size(), false);
    requireFilledFrames(scanner_, frames_.size(), skeleton_.bones.size(), bytes_);
  }

  void requireWholeFrame() {
    for (std::size_t j = 0; j < seen_.size(); ++j)
      if (!seen_[j] && !skeleton_.bones[j].channels.empty())
        scanner_.fail("frame " + std::to_string(number_) + " ends without bone " +
                      quotedWord(skeleton_.skeleton.name(static_cast<std::int32_t>(j))));
  }

  void readBone(std::string_view name) {
    if (frames_.empty()) scanner_.fail(quotedWord(name) + " stands where the number of the first frame should");
    const auto found = joints_.find(name);
    if (found == joints_.end()) scanner_.fail("the skeleton has no bone " + quotedWord(name));
    const auto joint = static_cast<std::size_t>(found->second);
    if (seen_[joint]) scanner_.fail("bone " + quotedWord(name) + " occurs twice in frame " + std::to_string(number_));
    seen_[joint] = true;
    readNumbers(joint);
    if (!scanner_.word().empty())
      scanner_.fail("bone " + quotedWord(name) + " has more numbers than the " +
                    std::to_string(skeleton_.bones[joint].channels.size()) + " that the skeleton says");
  }

  void readNumbers(std::size_t joint) {
    const auto& [axes, channels] = skeleton_.bones[joint];
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    auto& pose = frames_.back();
    for (const auto& channel : channels) {
      const double value =
          scanner_.number("an angle or position of each of " + std::to_string(channels.size()) + " freedoms");
      if (!std::isfinite(value)) scanner_.fail("an angle or position is not finite");
      if (channel.turns)
        rotation = axisTurn(channel.axis, value * radians_) * rotation;
      else
        pose.translation[channel.axis] = value * skeleton_.metres_per_unit;
    }
    if (!pose.translation.allFinite()) scanner_.fail("the root's position overflows");
    pose.rotations.row(static_cast<Eigen::Index>(joint)) = axisAngle(axes * rotation * axes.transpose()).transpose();
  }

  TextScanner scanner_;
  std::size_t bytes_;
  const AcclaimSkeleton& skeleton_;
  double radians_;
  std::map<std::string, std::int32_t, std::less<>> joints_;
  std::vector<Pose> frames_;
  std::vector<bool> seen_;  ///< the bones of the current frame
  std::int64_t number_ = 0;
};

}  // namespace

MotionClip parseAmc(const std::string& file, std::string_view text, const AcclaimSkeleton& skeleton, double rate_hz) {
  if (!(rate_hz > 0) || !std::isfinite(rate_hz))
    throw InvalidInput("rate_hz", "is " + shortest(rate_hz) + ", want a number above 0");
  return {skeleton.skeleton, skeleton.rest_joints, rate_hz, AmcReader(file, text, skeleton).read()};
}

MotionClip readAmc(const std::filesystem::path& path, const AcclaimSkeleton& skeleton, double rate_hz) {
  return parseAmc(path.string(), readFile(path), skeleton, rate_hz);
}

}  // namespace shaped
