#include "core/mesh/anchor.h"

#include <Eigen/Geometry>
#include <string>

#include "core/numerics/error.h"

namespace shaped {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSmallestEdge = 1e-12;  ///< metres; lengths below fade out

/// v / sqrt(|v|^2 + smallest^2): a unit vector, or towards zero where v vanishes; and its derivative.
struct Direction {
  Vector3d value;
  Matrix3d derivative;

  Direction(const Vector3d& v, double smallest) {
    const double length = std::sqrt(v.squaredNorm() + smallest * smallest);
    value = v / length;
    derivative = (Matrix3d::Identity() - value * value.transpose()) / length;
  }
};

Matrix3d crossMatrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

/// A triangle's corners, the two edges at its first corner, and its frame.
struct Triangle {
  Matrix3d corners;  ///< one a column
  Vector3d edge1, edge2;
  Direction tangent, normal;

  Triangle(const Faces& faces, const Vertices& vertices, std::int32_t face)
      : corners(cornersOf(faces, vertices, face)),
        edge1(corners.col(1) - corners.col(0)),
        edge2(corners.col(2) - corners.col(0)),
        tangent(edge1, kSmallestEdge),
        normal(edge1.cross(edge2), kSmallestEdge * kSmallestEdge) {}

  static Matrix3d cornersOf(const Faces& faces, const Vertices& vertices, std::int32_t face) {
    Matrix3d result;
    for (int c = 0; c < 3; ++c) result.col(c) = vertices.row(faces(face, c)).transpose();
    return result;
  }

  Matrix3d frame() const {
    Matrix3d result;
    result << tangent.value, normal.value.cross(tangent.value), normal.value;
    return result;
  }
};

void requireFace(const Faces& faces, std::int32_t face) {
  if (face < 0 || face >= faces.rows())
    throw InvalidInput("face", std::to_string(face) + " is outside [0, " + std::to_string(faces.rows()) + ")");
}

}  // namespace

Vector3d position(const Anchor& anchor, const Faces& faces, const Vertices& vertices) {
  const Triangle triangle(faces, vertices, anchor.face);
  return triangle.corners * anchor.barycentric + triangle.frame() * anchor.offset;
}

Eigen::Matrix<double, 3, 9> positionJacobian(const Anchor& anchor, const Faces& faces, const Vertices& vertices) {
  const Triangle triangle(faces, vertices, anchor.face);
  const Vector3d &t = triangle.tangent.value, &n = triangle.normal.value;
  const Matrix3d dt_edge1 = triangle.tangent.derivative;
  const Matrix3d dn_edge1 = -triangle.normal.derivative * crossMatrix(triangle.edge2);
  const Matrix3d dn_edge2 = triangle.normal.derivative * crossMatrix(triangle.edge1);
  const Matrix3d db_edge1 = crossMatrix(n) * dt_edge1 - crossMatrix(t) * dn_edge1;
  const Matrix3d db_edge2 = -crossMatrix(t) * dn_edge2;
  const auto& o = anchor.offset;
  const Matrix3d by_edge1 = o[0] * dt_edge1 + o[1] * db_edge1 + o[2] * dn_edge1;
  const Matrix3d by_edge2 = o[1] * db_edge2 + o[2] * dn_edge2;
  Eigen::Matrix<double, 3, 9> jacobian;
  jacobian << -by_edge1 - by_edge2, by_edge1, by_edge2;
  for (int c = 0; c < 3; ++c) jacobian.middleCols<3>(3 * c).diagonal().array() += anchor.barycentric[c];
  return jacobian;
}

Anchor makeAnchor(const Faces& faces, const Vertices& vertices, std::int32_t face, const Vector3d& point) {
  requireFace(faces, face);
  const Triangle triangle(faces, vertices, face);
  const Vector3d area = triangle.edge1.cross(triangle.edge2), from = point - triangle.corners.col(0);
  const double squared_area = area.squaredNorm();
  if (!(squared_area > 0)) throw InvalidInput("face", std::to_string(face) + " has no area to carry a point");
  const double w1 = from.cross(triangle.edge2).dot(area) / squared_area;
  const double w2 = triangle.edge1.cross(from).dot(area) / squared_area;
  Vector3d barycentric = Vector3d(1 - w1 - w2, w1, w2).cwiseMax(0);
  barycentric /= barycentric.sum();
  return makeAnchor(faces, vertices, face, barycentric, point);
}

Anchor makeAnchor(const Faces& faces, const Vertices& vertices, std::int32_t face, const Vector3d& barycentric,
                  const Vector3d& point) {
  requireFace(faces, face);
  const Triangle triangle(faces, vertices, face);
  if (!(triangle.edge1.cross(triangle.edge2).norm() > 0))
    throw InvalidInput("face", std::to_string(face) + " has no area to carry a point");
  return {face, barycentric, triangle.frame().transpose() * (point - triangle.corners * barycentric)};
}

}  // namespace shaped
