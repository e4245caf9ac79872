#include "core/mesh/quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Twice the area vector of a face.
Eigen::RowVector3d doubleAreaVector(const Faces& faces, const Vertices& vertices, Eigen::Index face) {
  const Eigen::RowVector3d origin = vertices.row(faces(face, 0));
  return (vertices.row(faces(face, 1)) - origin).cross(vertices.row(faces(face, 2)) - origin);
}

/// The squared length of doubleAreaVector(), by plain numbers, which compilers turn into several times faster code.
inline double squaredDoubleArea(const Faces& faces, const Vertices& vertices, Eigen::Index face) {
  const auto* corners = faces.data() + 3 * face;
  const double* a = vertices.data() + 3 * static_cast<Eigen::Index>(corners[0]);
  const double* b = vertices.data() + 3 * static_cast<Eigen::Index>(corners[1]);
  const double* c = vertices.data() + 3 * static_cast<Eigen::Index>(corners[2]);
  const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
  return x * x + y * y + z * z;
}

void normalizeRows(Vertices& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = rows.row(i).stableNormalized();
}

Eigen::VectorXd vertexDistances(const Vertices& one, const Vertices& two) {
  if (one.rows() < 1) throw InvalidInput("shape", "has no vertices to compare");
  if (one.rows() != two.rows())
    throw InvalidInput("shape", "has " + std::to_string(two.rows()) + " vertices, want " + std::to_string(one.rows()));
  return (one - two).rowwise().norm();
}

}  // namespace

Eigen::VectorXd triangleAreas(const Faces& faces, const Vertices& vertices) {
  return Eigen::VectorXd::NullaryExpr(
      faces.rows(), [&](Eigen::Index f) { return 0.5 * doubleAreaVector(faces, vertices, f).norm(); });
}

Eigen::VectorXd triangleQualities(const Faces& faces, const Vertices& vertices) {
  const auto quality = [&](Eigen::Index f) {
    double squared_edges = 0;
    for (int c = 0; c < 3; ++c)
      squared_edges += (vertices.row(faces(f, (c + 1) % 3)) - vertices.row(faces(f, c))).squaredNorm();
    const double area = 0.5 * doubleAreaVector(faces, vertices, f).norm();
    return squared_edges > 0 ? 4 * std::sqrt(3.0) * area / squared_edges : 0.0;
  };
  return Eigen::VectorXd::NullaryExpr(faces.rows(), quality);
}

ReferenceAreas::ReferenceAreas(const Faces& faces, const Vertices& reference)
    : faces_(faces), vertex_count_(reference.rows()), inverse_squares_(faces_.rows()) {
  for (Eigen::Index f = 0; f < faces_.rows(); ++f) inverse_squares_[f] = 1 / squaredDoubleArea(faces_, reference, f);
}

double ReferenceAreas::smallestRatio(const Vertices& shape) const {
  if (shape.rows() != vertex_count_)
    throw InvalidInput("shape",
                       "has " + std::to_string(shape.rows()) + " vertices, want " + std::to_string(vertex_count_));
  // One root at the end: this runs for every frame of a stream.
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < faces_.rows(); ++f)
    smallest = std::min(smallest, squaredDoubleArea(faces_, shape, f) * inverse_squares_[f]);
  return std::sqrt(smallest);
}

double smallestAreaRatio(const Faces& faces, const Vertices& reference, const Vertices& shape) {
  return ReferenceAreas(faces, reference).smallestRatio(shape);
}

Vertices faceNormals(const Faces& faces, const Vertices& vertices) {
  Vertices normals(faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) normals.row(f) = doubleAreaVector(faces, vertices, f);
  normalizeRows(normals);
  return normals;
}

Vertices vertexNormals(const Faces& faces, const Vertices& vertices) {
  Vertices normals = Vertices::Zero(vertices.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d area = doubleAreaVector(faces, vertices, f);
    for (int c = 0; c < 3; ++c) normals.row(faces(f, c)) += area;
  }
  normalizeRows(normals);
  return normals;
}

double boundingBoxDiagonal(const Vertices& vertices) {
  if (vertices.rows() == 0) return 0;
  return (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm();
}

double diameter(const Vertices& vertices) {
  if (vertices.rows() == 0) return 0;
  // two vertices are no farther apart than the sum of their distances from the centre: few pairs are left to measure
  const Eigen::RowVector3d centre = vertices.colwise().mean();
  const Eigen::VectorXd reach = (vertices.rowwise() - centre).rowwise().norm();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(vertices.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return reach[a] > reach[b]; });
  double widest = 0;
  for (std::size_t i = 0; i < order.size() && 2 * reach[order[i]] > widest; ++i)
    for (std::size_t j = i + 1; j < order.size() && reach[order[i]] + reach[order[j]] > widest; ++j)
      widest = std::max(widest, (vertices.row(order[i]) - vertices.row(order[j])).norm());
  return widest;
}

double meanVertexDistance(const Vertices& one, const Vertices& two) { return vertexDistances(one, two).mean(); }

double rmsVertexDistance(const Vertices& one, const Vertices& two) {
  return std::sqrt(vertexDistances(one, two).squaredNorm() / static_cast<double>(one.rows()));
}

double maxVertexDistance(const Vertices& one, const Vertices& two) { return vertexDistances(one, two).maxCoeff(); }

}  // namespace shaped
