#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "core/io/text_scanner.h"

namespace shaped {

/// What one number of a joint in a motion file says: a turn about an axis, or a shift along one.
struct MotionChannel {
  bool turns;
  int axis;  ///< 0 to 2: x, y, z
};

/// The rotation about a coordinate axis, right-handed.
Eigen::Matrix3d axisTurn(int axis, double radians);

/// Fails at the scanner's line when a motion of `bytes` bytes has more than 2^24 joints in its frames that it says
/// nothing of: joints without channels would make gigabytes of a small file. frames: those met so far.
void requireFilledFrames(const TextScanner& scanner, std::size_t frames, std::size_t joints, std::size_t bytes);

}  // namespace shaped
