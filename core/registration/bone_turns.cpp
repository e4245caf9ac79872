#include "core/registration/bone_turns.h"

#include <Eigen/Geometry>
#include <numbers>

#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

std::vector<Eigen::Matrix3d> boneTurns(const Eigen::Vector3d& bone, const std::vector<double>& tilts,
                                       const std::vector<double>& twists) {
  const Eigen::Vector3d axis = bone.normalized(), across = axis.unitOrthogonal();
  std::vector<Eigen::Matrix3d> turns;
  for (const double twist : twists) {
    const Eigen::Matrix3d twisted = rotationMatrix(twist * kDegree * axis);
    turns.push_back(twisted);
    for (const double tilt : tilts)
      for (int direction = 0; direction < 8; ++direction)
        turns.push_back(rotationMatrix(tilt * kDegree * (rotationMatrix(45 * direction * kDegree * axis) * across)) *
                        twisted);
  }
  return turns;
}

}  // namespace shaped
