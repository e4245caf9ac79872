#include "core/rendering/camera.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace shaped {

Camera orbitCamera(const Eigen::Vector3d& target, double distance, double azimuth, double elevation) {
  const Eigen::Vector3d outward(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                                std::cos(elevation) * std::cos(azimuth));
  Camera camera;
  camera.eye = target + distance * outward;
  camera.forward = -outward;
  camera.right = camera.forward.cross(Eigen::Vector3d::UnitY()).normalized();
  camera.up = camera.right.cross(camera.forward);
  return camera;
}

PlaneBox coveredBox(const Camera& camera, const Vertices& vertices) {
  PlaneBox box{PlanePoint::Constant(std::numeric_limits<double>::infinity()),
               PlanePoint::Constant(-std::numeric_limits<double>::infinity())};
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const PlanePoint point = camera.project(vertices.row(v).transpose());
    box.low = box.low.cwiseMin(point);
    box.high = box.high.cwiseMax(point);
  }
  return box;
}

}  // namespace shaped
