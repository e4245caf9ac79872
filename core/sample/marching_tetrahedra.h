#pragma once

#include <functional>

#include "core/mesh/types.h"

namespace shaped {

/// A triangle mesh.
struct SurfaceMesh {
  Vertices vertices;
  Faces faces;
};

/// The zero level of a function that is negative inside, as a closed, oriented 2-manifold: a grid of cubes, each cut
/// into six tetrahedra, so no ambiguous case arises (Doi and Koide 1991). Triangles are of uneven shape: remesh them.
/// low, high: corners of a box whose faces lie outside of the surface; spacing > 0: edge of a cube, same unit.
SurfaceMesh marchTetrahedra(const std::function<double(const Eigen::Vector3d&)>& value, const Eigen::Vector3d& low,
                            const Eigen::Vector3d& high, double spacing);

}  // namespace shaped
