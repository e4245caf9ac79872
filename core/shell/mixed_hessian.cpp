#include <Eigen/Core>

#include "core/shell/energy.h"
#include "core/shell/hinge_geometry.h"
#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

using Block = Eigen::Map<Eigen::Matrix3d>;

std::array<Eigen::Vector3d, 3> faceEdgeVectors(const Topology& topology, std::size_t f, const Vertices& shape) {
  const auto v = topology.faces().row(static_cast<Eigen::Index>(f));
  return {shape.row(v[2]) - shape.row(v[1]), shape.row(v[0]) - shape.row(v[2]), shape.row(v[1]) - shape.row(v[0])};
}

/// dl_k/dx_corner = +-2 e_k: edge k runs from corner k + 1 to corner k + 2.
double edgeSign(std::size_t k, std::size_t corner) { return corner == (k + 2) % 3 ? 2 : (corner == (k + 1) % 3 ? -2 : 0); }

void addFace(const std::array<std::int32_t, 9>& slots, const MembraneDensity& triangle,
             const std::array<Eigen::Vector3d, 3>& e, const std::array<Eigen::Vector3d, 3>& E, double weight,
             GeneralBlockMatrix& matrix) {
  std::array<Eigen::Vector3d, 3> combined;  // sum over deformed edges of mixed(k, m) dL_m for each corner is built below
  for (std::size_t column = 0; column < 3; ++column) {
    for (std::size_t k = 0; k < 3; ++k) {
      combined[k].setZero();
      for (std::size_t m = 0; m < 3; ++m) combined[k] += (weight * triangle.mixed(k, m) * edgeSign(m, column)) * E[m];
    }
    for (std::size_t row = 0; row < 3; ++row) {
      Block block(matrix.block(slots[3 * row + column]));
      for (std::size_t k = 0; k < 3; ++k)
        if (k != row) block += (edgeSign(k, row) * e[k]) * combined[k].transpose();
    }
  }
}

}  // namespace

void addMixedHessian(const ShellStructure& structure, const Vertices& undeformed,
                     const ShellMeasures& undeformed_measures, const Vertices& deformed,
                     const ShellMeasures& deformed_measures, double bending, double weight,
                     GeneralBlockMatrix& matrix) {
  const auto& topology = structure.topology();
  const auto& l = undeformed_measures.squared_length;
  const auto& L = deformed_measures.squared_length;
  for (std::size_t f = 0; f < topology.faceEdges().size(); ++f) {
    const auto& id = topology.faceEdges()[f];
    const auto row = static_cast<Eigen::Index>(f);
    const MembraneDensity triangle{{l[id[0]], l[id[1]], l[id[2]]},
                                   {L[id[0]], L[id[1]], L[id[2]]},
                                   undeformed_measures.area[row],
                                   deformed_measures.area[row]};
    addFace(structure.faceGeneralSlots()[f], triangle, faceEdgeVectors(topology, f, undeformed),
            faceEdgeVectors(topology, f, deformed), weight, matrix);
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto& hinge = hinges[h];
    const HingeGeometry one(hinge, undeformed), two(hinge, deformed);
    const double S = undeformed_measures.area[hinge.faces[0]] + undeformed_measures.area[hinge.faces[1]];
    const double squared = l[hinge.edges[0]];
    const double d = angleDifference(undeformed_measures.angle[static_cast<Eigen::Index>(h)],
                                     deformed_measures.angle[static_cast<Eigen::Index>(h)]);
    const double scale = -2 * weight * bending / S;
    for (std::size_t r = 0; r < 4; ++r) {
      // derivative of factor * d in the undeformed vertex r
      const Eigen::Vector3d row = scale * (squared * one.angleGradient(r) + d * one.lengthGradient(r) -
                                           (d * squared / S) * one.areaGradient(r));
      for (std::size_t c = 0; c < 4; ++c)
        Block(matrix.block(structure.hingeGeneralSlots()[h][4 * r + c])) += row * two.angleGradient(c).transpose();
    }
  }
}

}  // namespace shaped
