#pragma once

#include <Eigen/Core>

namespace shaped {

/// What one number of a joint in a motion file says: a turn about an axis, or a shift along one.
struct MotionChannel {
  bool turns;
  int axis;  ///< 0 to 2: x, y, z
};

/// The rotation about a coordinate axis, right-handed.
Eigen::Matrix3d axisTurn(int axis, double radians);

}  // namespace shaped
