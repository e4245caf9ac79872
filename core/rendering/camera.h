#pragma once

#include <Eigen/Core>

#include "core/mesh/types.h"

namespace shaped {

/// A point in the picture plane at distance 1 before the eye: x to the right, y up.
using PlanePoint = Eigen::Vector2d;

/// A perspective camera. y is up in the scene.
struct Camera {
  Eigen::Vector3d eye;
  Eigen::Vector3d right, up, forward;  ///< orthonormal

  /// Unit direction of the ray through a point of the picture plane.
  Eigen::Vector3d direction(const PlanePoint& point) const {
    return (forward + point.x() * right + point.y() * up).normalized();
  }

  /// Where a scene point before the eye appears in the picture plane.
  PlanePoint project(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d offset = point - eye;
    return PlanePoint(offset.dot(right), offset.dot(up)) / offset.dot(forward);
  }
};

/// A camera looking at `target` from `distance` away. azimuth: around the y axis from +z (front) towards +x, radians;
/// elevation: above the horizon, radians in (-pi/2, pi/2).
Camera orbitCamera(const Eigen::Vector3d& target, double distance, double azimuth, double elevation);

/// The part of the picture plane that the vertices cover.
struct PlaneBox {
  PlanePoint low, high;
  PlanePoint size() const { return high - low; }
  PlanePoint centre() const { return 0.5 * (low + high); }
};

PlaneBox coveredBox(const Camera& camera, const Vertices& vertices);

}  // namespace shaped
