#include "core/shell/block_updates.h"
#include "core/shell/energy.h"
#include "core/shell/face_geometry.h"
#include "core/shell/hinge_geometry.h"
#include "core/shell/membrane_density.h"

namespace shaped {
namespace {

/// One pair of shapes and the weights of its energy.
struct Pair {
  const Topology& topology;
  const Vertices &undeformed, &deformed;
  const ShellMeasures &rest, &current;
  double bending, weight;
};

/// Chain rule through the lengths: with dl_k = 2 e_k . (dx_{k+2} - dx_{k+1}) on both sides, the block of corners
/// (row, column) is e_{row+1} y_{row+1}^T - e_{row+2} y_{row+2}^T, y_k the derivative of df/dl_k in the column corner.
void addFace(const Pair& pair, std::size_t f, const std::array<std::int32_t, 9>& slots, GeneralBlockMatrix& matrix) {
  const auto& id = pair.topology.faceEdges()[f];
  const double *l = pair.rest.squared_length.data(), *L = pair.current.squared_length.data();
  const MembraneDensity triangle({l[id[0]], l[id[1]], l[id[2]]}, {L[id[0]], L[id[1]], L[id[2]]},
                                 pair.rest.area.data()[f], pair.current.area.data()[f]);
  const auto form = triangle.mixedHessian();
  const auto& faces = pair.topology.faces();
  const auto e = faceEdges(faces, static_cast<Eigen::Index>(f), pair.undeformed);
  auto E = faceEdges(faces, static_cast<Eigen::Index>(f), pair.deformed);
  for (auto& edge : E) edge *= 4 * pair.weight;
  for (std::size_t column = 0; column < 3; ++column) {
    const std::size_t next = (column + 1) % 3, last = (column + 2) % 3;
    std::array<Eigen::Vector3d, 3> y;
    for (std::size_t k = 0; k < 3; ++k) y[k] = form[k][next] * E[next] - form[k][last] * E[last];
    for (std::size_t row = 0; row < 3; ++row) {
      const std::size_t a = (row + 1) % 3, b = (row + 2) % 3;
      double* block = matrix.block(slots[3 * row + column]);
      addOuter(e[a], y[a], block);
      addOuter(e[b], -y[b], block);
    }
  }
}

/// Minus the derivative of 2 eta l / S d in the undeformed vertex times that of the deformed angle.
void addHinge(const Pair& pair, std::size_t h, const std::array<std::int32_t, 16>& slots, GeneralBlockMatrix& matrix) {
  const auto& hinge = pair.topology.hinges()[h];
  const HingeGeometry geometry(hinge, pair.undeformed);
  const auto deformed = HingeGeometry(hinge, pair.deformed).angleGradient();
  const auto angle = geometry.angleGradient(), length = geometry.lengthGradient(), area = geometry.areaGradient();
  const double* areas = pair.rest.area.data();
  const double inverse_area = 1 / (areas[hinge.faces[0]] + areas[hinge.faces[1]]);
  const double l = pair.rest.squared_length.data()[hinge.edges[0]];
  const double d = angleDifference(pair.rest.angle.data()[h], pair.current.angle.data()[h]);
  const double scale = -2 * pair.weight * pair.bending * inverse_area;
  const double by_angle = scale * l, by_length = scale * d, by_area = -by_angle * d * inverse_area;
  for (std::size_t r = 0; r < 4; ++r) {
    const Eigen::Vector3d row = by_angle * angle[r] + by_length * length[r] + by_area * area[r];
    for (std::size_t c = 0; c < 4; ++c) addOuter(row, deformed[c], matrix.block(slots[4 * r + c]));
  }
}

}  // namespace

void addMixedHessian(const ShellStructure& structure, const Vertices& undeformed,
                     const ShellMeasures& undeformed_measures, const Vertices& deformed,
                     const ShellMeasures& deformed_measures, double bending, double weight,
                     GeneralBlockMatrix& matrix) {
  const auto& topology = structure.topology();
  const Pair pair{topology, undeformed, deformed, undeformed_measures, deformed_measures, bending, weight};
  for (std::size_t f = 0; f < topology.faceEdges().size(); ++f)
    addFace(pair, f, structure.faceGeneralSlots()[f], matrix);
  for (std::size_t h = 0; h < topology.hinges().size(); ++h)
    addHinge(pair, h, structure.hingeGeneralSlots()[h], matrix);
}

}  // namespace shaped
