#include "core/skeleton/rotation.h"

#include <Eigen/Geometry>
#include <cmath>

namespace shaped {
namespace {

/// sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3, by their series where the quotients would cancel.
struct Coefficients {
  double first, second, third;
};

Coefficients coefficients(double squared_angle) {
  if (squared_angle < 1e-4) {
    const double s = squared_angle;
    return {1 - s / 6 + s * s / 120, 0.5 - s / 24 + s * s / 720, 1.0 / 6 - s / 120 + s * s / 5040};
  }
  const double angle = std::sqrt(squared_angle);
  return {std::sin(angle) / angle, (1 - std::cos(angle)) / squared_angle,
          (angle - std::sin(angle)) / (squared_angle * angle)};
}

}  // namespace

Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d result;
  result << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return result;
}

Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& w) {
  const auto [first, second, third] = coefficients(w.squaredNorm());
  const Eigen::Matrix3d cross = crossMatrix(w);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

Eigen::Vector3d axisAngle(const Eigen::Matrix3d& rotation) {
  // By way of the quaternion, whose vector part keeps its digits near the identity and near half a turn.
  const Eigen::Quaterniond quaternion(rotation);
  const double sine = quaternion.vec().norm();
  if (sine == 0) return Eigen::Vector3d::Zero();
  const double cosine = quaternion.w();
  const double angle = 2 * std::atan2(cosine < 0 ? -sine : sine, std::abs(cosine));
  return quaternion.vec() * (angle / sine);
}

Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& w) {
  const auto [first, second, third] = coefficients(w.squaredNorm());
  const Eigen::Matrix3d cross = crossMatrix(w);
  return Eigen::Matrix3d::Identity() + second * cross + third * cross * cross;
}

}  // namespace shaped
