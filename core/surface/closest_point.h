#pragma once

#include <memory>

#include "core/mesh/types.h"

namespace shaped {

/// The point of triangle (a, b, c) closest to another point.
struct TrianglePoint {
  Eigen::RowVector3d barycentric;  ///< weights of a, b, c: non-negative, sum 1
  Eigen::RowVector3d position;
  double squared_distance;
};

/// The point of a triangle closest to `query`, in double precision; right for triangles without area too (their edges).
TrianglePoint closestPointOnTriangle(const Eigen::RowVector3d& query, const Eigen::RowVector3d& a,
                                     const Eigen::RowVector3d& b, const Eigen::RowVector3d& c);

/// A point on a triangle mesh.
struct SurfacePoint {
  std::int32_t face;
  Eigen::RowVector3d barycentric;  ///< weights of the face's corners: non-negative, sum 1
  Eigen::RowVector3d position;
  double distance;  ///< from the query to `position`, in the mesh's unit
};

/// Closest points on one mesh: a bounding volume hierarchy built once, then many queries.
///
/// The hierarchy prunes in single precision with a margin for its rounding, and every candidate is measured in double
/// precision, so answers are exact to rounding. A query is const and may run from several threads at once.
class ClosestPointQuery {
 public:
  /// vertices: V x 3; faces: F x 3, F >= 1. The mesh is copied. Throws InvalidInput when there is no face, an index is
  /// out of range or a coordinate is not finite.
  ClosestPointQuery(const Vertices& vertices, const Faces& faces);
  ~ClosestPointQuery();
  ClosestPointQuery(ClosestPointQuery&&) noexcept;
  ClosestPointQuery& operator=(ClosestPointQuery&&) noexcept;

  /// point: three finite coordinates, in the mesh's unit. Throws InvalidInput when a coordinate is not finite.
  SurfacePoint operator()(const Eigen::RowVector3d& point) const;

 private:
  struct Hierarchy;
  std::unique_ptr<Hierarchy> hierarchy_;
};

/// Distance of every point (N x 3) to the mesh, N values in the mesh's unit. Throws as ClosestPointQuery does.
Eigen::VectorXd distancesToSurface(const Vertices& points, const Vertices& vertices, const Faces& faces);

}  // namespace shaped
