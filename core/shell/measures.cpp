#include "core/shell/measures.h"

#include <Eigen/Geometry>
#include <cmath>

namespace shaped {

void measure(const Topology& topology, const Vertices& shape, ShellMeasures& result) {
  const auto& edges = topology.edges();
  result.squared_length.resize(static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    result.squared_length[static_cast<Eigen::Index>(e)] = (shape.row(edges[e][0]) - shape.row(edges[e][1])).squaredNorm();

  const auto& faces = topology.faces();
  Vertices normal(faces.rows(), 3);  // twice the area vector
  result.area.resize(faces.rows());
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = shape.row(faces(f, 0)), b = shape.row(faces(f, 1)), c = shape.row(faces(f, 2));
    const Eigen::Vector3d n = (b - a).cross(c - a);
    normal.row(f) = n;
    result.area[f] = 0.5 * n.norm();
  }

  const auto& hinges = topology.hinges();
  result.angle.resize(static_cast<Eigen::Index>(hinges.size()));
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto& v = hinges[h].vertices;
    const Eigen::Vector3d n1 = normal.row(hinges[h].faces[0]), n2 = normal.row(hinges[h].faces[1]);
    const double length = std::sqrt(result.squared_length[hinges[h].edges[0]]);
    // n1 x n2 = -e (n1 . (x3 - x0)), so the edge serves as the axis without a division
    const double sine = -length * n1.dot(shape.row(v[3]) - shape.row(v[0]));
    result.angle[static_cast<Eigen::Index>(h)] = std::atan2(sine, n1.dot(n2));
  }
}

ShellMeasures measure(const Topology& topology, const Vertices& shape) {
  ShellMeasures result;
  measure(topology, shape, result);
  return result;
}

}  // namespace shaped
