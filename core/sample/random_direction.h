#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "core/sample/random.h"

namespace shaped {

/// A unit vector, evenly over the sphere: height and azimuth are uniform (Archimedes).
inline Eigen::Vector3d randomDirection(Random& random) {
  const double height = random.uniform(-1, 1), azimuth = random.uniform(0, 2 * std::numbers::pi);
  const double radius = std::sqrt(1 - height * height);
  return {radius * std::cos(azimuth), height, radius * std::sin(azimuth)};
}

}  // namespace shaped
