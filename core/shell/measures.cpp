#include "core/shell/measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/numerics/vector_math.h"

namespace shaped {
namespace {

Eigen::Vector3d between(const Vertices& shape, std::int32_t from, std::int32_t to) {
  return shape.row(to) - shape.row(from);
}

void measureLengths(const Topology& topology, const Vertices& shape, Eigen::VectorXd& squared) {
  const auto& edges = topology.edges();
  squared.resize(static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    squared.data()[e] = between(shape, edges[e][0], edges[e][1]).squaredNorm();
}

void measureAreas(const Topology& topology, const Vertices& shape, Eigen::VectorXd& area) {
  const auto& faces = topology.faces();
  area.resize(faces.rows());
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const auto v = faces.row(f);
    area[f] = 0.5 * between(shape, v[0], v[1]).cross(between(shape, v[0], v[2])).norm();
  }
}

/// Sine and cosine of a hinge's angle, both times the product of its faces' doubled areas.
struct ScaledAngle {
  double sine, cosine;
};

ScaledAngle scaledAngle(const Hinge& hinge, const Vertices& shape) {
  const auto& v = hinge.vertices;
  const Eigen::Vector3d edge = between(shape, v[0], v[1]), second = between(shape, v[0], v[3]);
  const Eigen::Vector3d n1 = edge.cross(between(shape, v[0], v[2])), n2 = second.cross(edge);
  // n1 x n2 = -edge (n1 . second), so the edge serves as the axis without a division
  return {-edge.norm() * n1.dot(second), n1.dot(n2)};
}

void measureAngles(const Topology& topology, const Vertices& shape, Eigen::VectorXd& angle) {
  constexpr std::size_t kBatch = 256;
  std::array<double, kBatch> sine, cosine;
  const auto& hinges = topology.hinges();
  angle.resize(static_cast<Eigen::Index>(hinges.size()));
  for (std::size_t begin = 0; begin < hinges.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, hinges.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      const auto scaled = scaledAngle(hinges[begin + i], shape);
      sine[i] = scaled.sine;
      cosine[i] = scaled.cosine;
    }
    arcTangents({sine.data(), count}, {cosine.data(), count}, {angle.data() + begin, count});
  }
}

}  // namespace

void measure(const Topology& topology, const Vertices& shape, ShellMeasures& result) {
  measureLengths(topology, shape, result.squared_length);
  measureAreas(topology, shape, result.area);
  measureAngles(topology, shape, result.angle);
}

ShellMeasures measure(const Topology& topology, const Vertices& shape) {
  ShellMeasures result;
  measure(topology, shape, result);
  return result;
}

}  // namespace shaped
