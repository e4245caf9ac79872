#include "core/io/motion_channel.h"

#include <cmath>

namespace shaped {

Eigen::Matrix3d axisTurn(int axis, double radians) {
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(next, next) = turn(last, last) = std::cos(radians);
  turn(last, next) = std::sin(radians);
  turn(next, last) = -turn(last, next);
  return turn;
}

void requireFilledFrames(const TextScanner& scanner, std::size_t frames, std::size_t joints, std::size_t bytes) {
  constexpr std::size_t most_omitted = 1 << 24;
  // A joint with channels takes a byte at least.
  if (frames * joints > bytes + most_omitted)
    scanner.fail("frames of " + std::to_string(joints) + " joints leave out more than " + std::to_string(most_omitted) +
                 " of them; give every joint its rotation");
}

}  // namespace shaped
