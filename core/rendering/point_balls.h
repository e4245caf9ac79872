#pragma once

#include "core/mesh/types.h"

namespace shaped {

/// Points as little octahedra, for renderContactSheet: a point cloud becomes a mesh that can be drawn.
struct PointBalls {
  Vertices vertices;  ///< 6 N x 3
  Faces faces;        ///< 8 N x 3, outward
};

/// points: N x 3. radius: in their unit, > 0.
PointBalls pointBalls(const Vertices& points, double radius);

/// A radius at which the points of a surface about as large as their bounding box nearly touch; 1 where they coincide.
double touchingRadius(const Vertices& points);

}  // namespace shaped
