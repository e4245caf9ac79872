#include "tests/support/literal_shell_energy.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace shaped::test {
namespace {

Eigen::Vector3d corner(const Topology& topology, const Vertices& s, Eigen::Index f, int c) {
  return s.row(topology.faces()(f, c));
}

Eigen::Matrix2d firstFundamentalForm(const Topology& topology, const Vertices& s, Eigen::Index f) {
  Eigen::Matrix<double, 3, 2> frame;
  frame << corner(topology, s, f, 1) - corner(topology, s, f, 0), corner(topology, s, f, 2) - corner(topology, s, f, 0);
  return frame.transpose() * frame;
}

Eigen::Vector3d unitNormal(const Topology& topology, const Vertices& s, Eigen::Index f) {
  const Eigen::Vector3d a = corner(topology, s, f, 0);
  return (corner(topology, s, f, 1) - a).cross(corner(topology, s, f, 2) - a).normalized();
}

double foldAngle(const Topology& topology, const Vertices& s, const Hinge& hinge) {
  const Eigen::Vector3d n1 = unitNormal(topology, s, hinge.faces[0]), n2 = unitNormal(topology, s, hinge.faces[1]);
  const double angle = std::acos(std::clamp(n1.dot(n2), -1.0, 1.0));
  const Eigen::Vector3d across = s.row(hinge.vertices[3]) - s.row(hinge.vertices[0]);
  return across.dot(n1) < 0 ? angle : -angle;
}

}  // namespace

double literalShellEnergy(const Topology& topology, const Vertices& undeformed, const Vertices& deformed, double eta) {
  double energy = 0;
  for (Eigen::Index f = 0; f < topology.faces().rows(); ++f) {
    const Eigen::Matrix2d g = firstFundamentalForm(topology, undeformed, f);
    const Eigen::Matrix2d strain = g.inverse() * firstFundamentalForm(topology, deformed, f);
    const double density =
        0.5 * strain.trace() + 0.25 * strain.determinant() - 0.75 * std::log(strain.determinant()) - 1.25;
    energy += 0.5 * std::sqrt(g.determinant()) * density;
  }
  for (const auto& hinge : topology.hinges()) {
    const double areas = 0.5 * std::sqrt(firstFundamentalForm(topology, undeformed, hinge.faces[0]).determinant()) +
                         0.5 * std::sqrt(firstFundamentalForm(topology, undeformed, hinge.faces[1]).determinant());
    const double squared = (undeformed.row(hinge.vertices[1]) - undeformed.row(hinge.vertices[0])).squaredNorm();
    const double fold = foldAngle(topology, undeformed, hinge) - foldAngle(topology, deformed, hinge);
    energy += eta * fold * fold * squared / areas;
  }
  return energy;
}

}  // namespace shaped::test
