#pragma once

#include <Eigen/Geometry>
#include <array>

#include "core/mesh/types.h"

namespace shaped {

/// A triangle's edge vectors: entry i runs from corner i + 1 to corner i + 2.
inline std::array<Eigen::Vector3d, 3> faceEdges(const Faces& faces, Eigen::Index f, const Vertices& shape) {
  const Eigen::Vector3d x0 = shape.row(faces(f, 0)), x1 = shape.row(faces(f, 1)), x2 = shape.row(faces(f, 2));
  return {x2 - x1, x0 - x2, x1 - x0};
}

/// One triangle's edges and normal, and how its area and the fold angles at its edges depend on its corners.
///
/// Edge e_i runs from corner i + 1 to corner i + 2; N = n |N| is twice the area vector; d_i = -e_{i+1} . e_{i+2} is
/// half of l_{i+1} + l_{i+2} - l_i. Then
///   d(area)/dl_i = d_i / (4 |N|),   and for a function of the fold angles with slopes w_k at edge k, u_k = w_k /
///   |e_k|, its derivative in corner i through this triangle is c_i N / |N|^2, c_i = d_{i+2} (u_{i+1} - u_i) + d_{i+1}
///   (u_{i+2} - u_i).
struct FaceGeometry {
  std::array<Eigen::Vector3d, 3> e;
  Eigen::Vector3d doubled_area_vector;  ///< N
  std::array<double, 3> d;
  double squared_norm;  ///< |N|^2

  FaceGeometry(const Faces& faces, Eigen::Index f, const Vertices& shape)
      : e(faceEdges(faces, f, shape)),
        doubled_area_vector(e[0].cross(e[1])),
        d{-e[1].dot(e[2]), -e[2].dot(e[0]), -e[0].dot(e[1])},
        squared_norm(doubled_area_vector.squaredNorm()) {}

  /// c_i above.
  std::array<double, 3> foldCoefficients(const std::array<double, 3>& u) const {
    return {d[2] * (u[1] - u[0]) + d[1] * (u[2] - u[0]), d[0] * (u[2] - u[1]) + d[2] * (u[0] - u[1]),
            d[1] * (u[0] - u[2]) + d[0] * (u[1] - u[2])};
  }
};

}  // namespace shaped
