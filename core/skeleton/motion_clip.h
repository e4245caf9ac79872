#pragma once

#include <vector>

#include "core/skeleton/pose.h"

namespace shaped {

/// A recorded motion: a skeleton of fixed bone lengths and its pose over time.
struct MotionClip {
  Skeleton skeleton;
  Vertices rest_joints;  ///< J x 3, m
  double rate_hz;        ///< frames a second, > 0
  std::vector<Pose> frames;
};

}  // namespace shaped
