#include "core/io/motion_channel.h"

#include "core/skeleton/rotation.h"

namespace shaped {

Eigen::Matrix3d axisTurn(int axis, double radians) { return rotationMatrix(radians * Eigen::Vector3d::Unit(axis)); }

}  // namespace shaped
