#include "core/surface/turned_edges.h"

#include "core/numerics/error.h"
#include "core/numerics/scalar_cholesky.h"
#include "core/surface/laplacian.h"

namespace shaped {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// sum_j c_ij (R_i + R_j)/2 (x_i - x_j); entries of the stiffness are -c_ij.
Vertices rightHandSide(const Sparse& stiffness, const Vertices& shape, const std::vector<Eigen::Matrix3d>& rotations) {
  Vertices sums = Vertices::Zero(shape.rows(), 3);
  for (Eigen::Index column = 0; column < stiffness.outerSize(); ++column)
    for (Sparse::InnerIterator entry(stiffness, column); entry; ++entry) {
      if (entry.row() == column) continue;
      const Eigen::Matrix3d turn = 0.5 * (rotations[std::size_t(entry.row())] + rotations[std::size_t(column)]);
      sums.row(entry.row()) -= entry.value() * (shape.row(entry.row()) - shape.row(column)) * turn.transpose();
    }
  return sums;
}

/// Holds one vertex of each component at the origin: without a place, the system would not be definite. As the right
/// hand side sums to zero over a component, this changes the solution by a translation alone.
void pinComponents(Sparse& stiffness, const Topology& topology) {
  std::vector<bool> pinned(std::size_t(topology.componentCount()), false);
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v) {
    auto component = pinned[std::size_t(topology.components()[std::size_t(v)])];
    if (component) continue;
    component = true;
    stiffness.coeffRef(v, v) += 1;
  }
}

/// Moves each component to where the other shape has its mean vertex.
void placeComponents(Vertices& shape, const Topology& topology, const Vertices& places) {
  const auto& components = topology.components();
  Vertices shifts = Vertices::Zero(topology.componentCount(), 3);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(topology.componentCount());
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    shifts.row(components[std::size_t(v)]) += places.row(v) - shape.row(v);
    counts[components[std::size_t(v)]] += 1;
  }
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    const auto component = components[std::size_t(v)];
    shape.row(v) += shifts.row(component) / counts[component];
  }
}

}  // namespace

Vertices turnedEdges(const Topology& topology, const Vertices& shape, const std::vector<Eigen::Matrix3d>& rotations,
                     const Vertices& places) {
  requireValidShape(topology, shape, "shape");
  if (std::int32_t(rotations.size()) != topology.vertexCount() || places.rows() != shape.rows())
    throw InvalidInput("rotations", "has " + std::to_string(rotations.size()) + " entries and places " +
                                        std::to_string(places.rows()) + ", want one for each of " +
                                        std::to_string(topology.vertexCount()) + " vertices");
  Sparse stiffness = cotangentStiffness(shape, topology.faces());
  const Vertices right = rightHandSide(stiffness, shape, rotations);
  pinComponents(stiffness, topology);
  stiffness.makeCompressed();
  ScalarCholesky factor;
  if (!factor.compute(stiffness)) throw InvalidInput("shape", "has triangles too thin for a Laplacian deformation");
  Vertices result = factor.solve(right);
  placeComponents(result, topology, places);
  return result;
}

}  // namespace shaped
