#include "core/mesh/group_quadrics.h"

#include <Eigen/Geometry>
#include <vector>

namespace shaped {

namespace {

constexpr double kBoundaryWeight = 10;
constexpr double kSpacingWeight = 0.01;

/// How many faces each edge has.
std::vector<int> facesPerEdge(const Topology& topology) {
  std::vector<int> count(topology.edges().size(), 0);
  for (const auto& edges : topology.faceEdges())
    for (const auto edge : edges) ++count[edge];
  return count;
}

}  // namespace

GroupQuadrics::GroupQuadrics(const Topology& topology, const ShapeGroup& shapes)
    : quadrics_(Eigen::ArrayXXd::Zero(shapes.size(), kCoefficients * topology.vertexCount())) {
  const auto& faces = topology.faces();
  const auto edge_faces = facesPerEdge(topology);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (Eigen::Index s = 0; s < shapes.size(); ++s) {
      const Eigen::RowVector3d corners[] = {shapes.position(s, faces(f, 0)), shapes.position(s, faces(f, 1)),
                                            shapes.position(s, faces(f, 2))};
      const Eigen::RowVector3d area_vector = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const double area = area_vector.norm();
      const Eigen::RowVector3d normal = area_vector / area;
      for (int c = 0; c < 3; ++c) {
        addPlane(s, faces(f, c), normal, corners[0], area / 3);
        addPoint(s, faces(f, c), corners[c], kSpacingWeight * area / 3);
        if (edge_faces[topology.faceEdges()[f][c]] == 2) continue;
        const int from = (c + 1) % 3, to = (c + 2) % 3;
        const Eigen::RowVector3d edge = corners[to] - corners[from];
        const Eigen::RowVector3d upright = edge.cross(normal).normalized();
        for (const int end : {from, to})
          addPlane(s, faces(f, end), upright, corners[from], kBoundaryWeight * edge.squaredNorm() / 2);
      }
    }
  }
}

void GroupQuadrics::addPlane(Eigen::Index shape, std::int32_t v, const Eigen::RowVector3d& normal,
                             const Eigen::RowVector3d& point, double weight) {
  const double d = -normal.dot(point);
  const double x = normal[0], y = normal[1], z = normal[2];
  Eigen::Array<double, 1, kCoefficients> plane;
  plane << x * x, x * y, x * z, y * y, y * z, z * z, d * x, d * y, d * z, d * d;
  quadrics_.block<1, kCoefficients>(shape, kCoefficients * v) += weight * plane;
}

void GroupQuadrics::addPoint(Eigen::Index shape, std::int32_t v, const Eigen::RowVector3d& point, double weight) {
  Eigen::Array<double, 1, kCoefficients> distance;
  distance << 1, 0, 0, 1, 0, 1, -point[0], -point[1], -point[2], point.squaredNorm();
  quadrics_.block<1, kCoefficients>(shape, kCoefficients * v) += weight * distance;
}

double GroupQuadrics::collapseError(const ShapeGroup& shapes, std::int32_t from, std::int32_t to) const {
  const auto x = shapes.coordinate(to, 0), y = shapes.coordinate(to, 1), z = shapes.coordinate(to, 2);
  const auto a = coefficients(from), b = coefficients(to);
  const auto q = [&](int k) { return a.col(k) + b.col(k); };
  const double error = (x * (x * q(0) + 2 * (y * q(1) + z * q(2) + q(6))) + y * (y * q(3) + 2 * (z * q(4) + q(7))) +
                        z * (z * q(5) + 2 * q(8)) + q(9))
                           .sum();
  return error > 0 ? error : 0;
}

void GroupQuadrics::merge(std::int32_t from, std::int32_t to) {
  quadrics_.middleCols<kCoefficients>(kCoefficients * to) += coefficients(from);
}

}  // namespace shaped
