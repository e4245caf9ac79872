#include "core/surface/laplacian.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>
#include <vector>

#include "core/mesh/quality.h"
#include "core/surface/triangles.h"

namespace shaped {
namespace {

constexpr double kThinnest = 1e-12;  ///< area over longest edge squared, as in requireValidShape

/// Halves of the cotangents at the three corners.
Eigen::Vector3d halfCotangents(const Eigen::Matrix3d& corners) {
  Eigen::Matrix3d edges;  // row c: the edge opposite corner c
  for (int c = 0; c < 3; ++c) edges.row(c) = corners.row((c + 2) % 3) - corners.row((c + 1) % 3);
  const double longest = edges.rowwise().squaredNorm().maxCoeff();
  if (!(longest > 0)) return Eigen::Vector3d::Zero();
  // One area for all three: were each to round on its own, a sliver's element matrix would not be semi-definite.
  const Eigen::RowVector3d one = edges.row(2), other = edges.row(1);
  const double double_area = std::max(one.cross(other).norm(), 2 * kThinnest * longest);
  Eigen::Vector3d result;
  for (int c = 0; c < 3; ++c) result[c] = -0.5 * edges.row((c + 1) % 3).dot(edges.row((c + 2) % 3)) / double_area;
  return result;
}

}  // namespace

Eigen::SparseMatrix<double> cotangentStiffness(const Vertices& vertices, const Faces& faces, ObtuseCorners obtuse) {
  requireTriangles(vertices, faces);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(12 * faces.rows()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    auto weights = halfCotangents(vertices(faces.row(f), Eigen::all));
    if (obtuse == ObtuseCorners::kAsZero) weights = weights.cwiseMax(0).eval();
    for (int c = 0; c < 3; ++c) {
      const auto i = faces(f, (c + 1) % 3), j = faces(f, (c + 2) % 3);
      for (const auto& [row, column, sign] : {std::tuple{i, i, 1}, {j, j, 1}, {i, j, -1}, {j, i, -1}})
        entries.emplace_back(row, column, sign * weights[c]);
    }
  }
  Eigen::SparseMatrix<double> stiffness(vertices.rows(), vertices.rows());
  stiffness.setFromTriplets(entries.begin(), entries.end());
  return stiffness;
}

Eigen::VectorXd lumpedAreas(const Vertices& vertices, const Faces& faces) {
  requireTriangles(vertices, faces);
  const auto areas = triangleAreas(faces, vertices);
  Eigen::VectorXd lumped = Eigen::VectorXd::Zero(vertices.rows());
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c) lumped[faces(f, c)] += areas[f] / 3;
  return lumped;
}

}  // namespace shaped
