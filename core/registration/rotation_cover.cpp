#include "core/registration/rotation_cover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace shaped {
namespace {

using Quaternions = std::vector<Eigen::Vector4d>;

/// The 24 unit quaternions of the tetrahedron (Hurwitz units).
void appendTetrahedral(Quaternions& group) {
  for (int axis = 0; axis < 4; ++axis)
    for (const double sign : {1.0, -1.0}) group.push_back(sign * Eigen::Vector4d::Unit(axis));
  for (int signs = 0; signs < 16; ++signs) {
    Eigen::Vector4d q;
    for (int axis = 0; axis < 4; ++axis) q[axis] = signs >> axis & 1 ? -0.5 : 0.5;
    group.push_back(q);
  }
}

/// The 96 even permutations of (0, +-1/phi, +-1, +-phi) / 2.
void appendGolden(Quaternions& group) {
  const double phi = std::numbers::phi;
  const std::array<double, 4> values{0, 0.5 / phi, 0.5, 0.5 * phi};
  std::array<int, 4> place{0, 1, 2, 3};
  do {
    int inversions = 0;
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) inversions += place[std::size_t(a)] > place[std::size_t(b)];
    if (inversions % 2) continue;
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Vector4d q;
      for (int axis = 0; axis < 4; ++axis) {
        const int value = place[std::size_t(axis)];
        q[axis] = values[std::size_t(value)] * (value > 0 && (signs >> (value - 1) & 1) ? -1 : 1);
      }
      group.push_back(q);
    }
  } while (std::next_permutation(place.begin(), place.end()));
}

/// One of the two quaternions of each rotation.
bool isRepresentative(const Eigen::Vector4d& q) {
  for (int axis = 0; axis < 4; ++axis)
    if (std::abs(q[axis]) > 1e-9) return q[axis] > 0;
  return true;
}

}  // namespace

std::vector<Eigen::Matrix3d> icosahedralRotations() {
  Quaternions group;
  appendTetrahedral(group);
  appendGolden(group);
  std::vector<Eigen::Matrix3d> rotations;
  for (const auto& q : group)
    if (isRepresentative(q)) rotations.push_back(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix());
  return rotations;
}

double angleBetween(const Eigen::Matrix3d& one, const Eigen::Matrix3d& other) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(one.transpose() * other)).angle();
}

}  // namespace shaped
