#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "core/mesh/types.h"

namespace shaped {

/// Where a ray meets the mesh.
struct RayHit {
  std::int32_t face;
  Eigen::RowVector3d barycentric;  ///< weights of the face's corners
  Eigen::Vector3d position;
  Eigen::Vector3d face_normal;    ///< unit, as the corners turn
  Eigen::Vector3d smooth_normal;  ///< unit, interpolated from the vertices
  Eigen::Vector3d lifted;         ///< the position raised to the smooth surface: where shadow rays start
  bool back_face;                 ///< seen from inside, or an inverted triangle
};

/// One mesh prepared for ray casting; const queries may run from several threads at once.
class RayScene {
 public:
  /// vertices: V x 3, finite; faces: F x 3, in range. floor: the y of the ground.
  RayScene(const Vertices& vertices, const Faces& faces, double floor);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The first hit of a ray with unit direction.
  std::optional<RayHit> firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// Whether anything lies along the ray, rounding distance from its origin left out.
  bool occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// Half the diagonal of the bounding box.
  double radius() const { return radius_; }
  double floor() const { return floor_; }

 private:
  struct Embree;
  Vertices vertices_, normals_;
  Faces faces_;
  double radius_, floor_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace shaped
