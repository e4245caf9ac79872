#include "core/neural/jacobian_poisson.h"

#include <Eigen/Geometry>
#include <string>
#include <utility>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/surface/laplacian.h"

namespace shaped {
namespace {

using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// A grad phi_c, one corner a row: half the edge opposite, turned by a right angle within the triangle to point at the
/// corner.
RowMatrix3 cornerFluxes(const RowMatrix3& corners) {
  const Eigen::RowVector3d first = corners.row(1) - corners.row(0), second = corners.row(2) - corners.row(0);
  const Eigen::RowVector3d normal = first.cross(second).normalized();
  RowMatrix3 fluxes;
  for (int c = 0; c < 3; ++c) fluxes.row(c) = 0.5 * normal.cross(corners.row((c + 2) % 3) - corners.row((c + 1) % 3));
  return fluxes;
}

/// Makes the matrix definite without touching the solution: right-hand sides sum to zero over a component, as L's rows
/// do, so a further weight on one vertex leaves that vertex at zero.
void pinOneVertexOfEach(const Topology& topology, Eigen::SparseMatrix<double>& stiffness) {
  std::int32_t pinned = 0;  // components are numbered by their first vertex
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v)
    if (topology.components()[v] == pinned) {
      stiffness.coeffRef(v, v) *= 2;
      ++pinned;
    }
}

/// Each vertex's part of its component's area.
Eigen::VectorXd sharesOf(const Topology& topology, Eigen::VectorXd areas) {
  Eigen::VectorXd whole = Eigen::VectorXd::Zero(topology.componentCount());
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v) whole[topology.components()[v]] += areas[v];
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v) areas[v] /= whole[topology.components()[v]];
  return areas;
}

template <class Matrix>
void requireRows(const Matrix& matrix, Eigen::Index rows, const char* field) {
  if (matrix.rows() != rows)
    throw InvalidInput(field, "has " + std::to_string(matrix.rows()) + " rows, want " + std::to_string(rows));
  if (!matrix.allFinite()) throw InvalidInput(field, "holds a number that is not finite");
}

}  // namespace

JacobianPoisson::JacobianPoisson(TopologyPtr topology, const Vertices& source)
    : topology_(std::move(topology)),
      areas_(triangleAreas(topology_->faces(), source)),
      corner_fluxes_(areas_.size(), 9),
      shares_(sharesOf(*topology_, lumpedAreas(source, topology_->faces()))),
      source_centroids_(weightedMeans(source)) {
  for (Eigen::Index f = 0; f < areas_.size(); ++f)
    Eigen::Map<RowMatrix3>(corner_fluxes_.row(f).data()) = cornerFluxes(source(topology_->faces().row(f), Eigen::all));
}

std::shared_ptr<const JacobianPoisson> JacobianPoisson::make(TopologyPtr topology, const Vertices& source,
                                                             const std::stop_token& stop) {
  requireValidShape(*topology, source, "source");
  if (stop.stop_requested()) return nullptr;
  const std::shared_ptr<JacobianPoisson> poisson(new JacobianPoisson(std::move(topology), source));
  auto stiffness = cotangentStiffness(source, poisson->topology().faces());
  pinOneVertexOfEach(poisson->topology(), stiffness);
  if (poisson->factor_.compute(stiffness, stop)) return poisson;
  if (stop.stop_requested()) return nullptr;
  throw InvalidInput("source", "has triangles too thin to solve a Poisson equation on; repair it");
}

Vertices JacobianPoisson::solve(const Jacobians& jacobians) const { return solve(jacobians, source_centroids_); }

Vertices JacobianPoisson::solve(const Jacobians& jacobians, const Vertices& centroids) const {
  requireRows(jacobians, areas_.size(), "jacobians");
  requireRows(centroids, topology_->componentCount(), "centroids");
  Vertices shape = factor_.solve(divergence(jacobians));
  const Vertices shift = centroids - weightedMeans(shape);
  for (Eigen::Index v = 0; v < shape.rows(); ++v) shape.row(v) += shift.row(topology_->components()[v]);
  return shape;
}

Jacobians JacobianPoisson::backward(const Vertices& gradient) const {
  requireRows(gradient, topology_->vertexCount(), "gradient");
  // The shift to the centroid, transposed: each vertex gives its share of the component's whole gradient back.
  Vertices whole = Vertices::Zero(topology_->componentCount(), 3);
  for (Eigen::Index v = 0; v < gradient.rows(); ++v) whole.row(topology_->components()[v]) += gradient.row(v);
  Vertices balanced = gradient;
  for (Eigen::Index v = 0; v < gradient.rows(); ++v)
    balanced.row(v) -= shares_[v] * whole.row(topology_->components()[v]);
  return gradients(factor_.solve(balanced));
}

Jacobians JacobianPoisson::jacobians(const Vertices& shape) const {
  requireRows(shape, topology_->vertexCount(), "shape");
  return areas_.cwiseInverse().asDiagonal() * gradients(shape);
}

Vertices JacobianPoisson::centroids(const Vertices& shape) const {
  requireRows(shape, topology_->vertexCount(), "shape");
  return weightedMeans(shape);
}

std::size_t JacobianPoisson::bytes() const {
  return factor_.bytes() +
         sizeof(double) * static_cast<std::size_t>(areas_.size() + corner_fluxes_.size() + shares_.size());
}

/// sum over the triangles around each vertex of A_f J_f grad phi_c, V x 3.
Vertices JacobianPoisson::divergence(const Jacobians& jacobians) const {
  Vertices sums = Vertices::Zero(topology_->vertexCount(), 3);
  for (Eigen::Index f = 0; f < areas_.size(); ++f) {
    const Eigen::Map<const RowMatrix3> jacobian(jacobians.row(f).data()), fluxes(corner_fluxes_.row(f).data());
    const RowMatrix3 corners = fluxes * jacobian.transpose();
    for (int c = 0; c < 3; ++c) sums.row(topology_->faces()(f, c)) += corners.row(c);
  }
  return sums;
}

/// A_f J_f of a shape, F x 9: the transpose of divergence(). From edges, as positions may be far from the origin.
Jacobians JacobianPoisson::gradients(const Vertices& shape) const {
  Jacobians result(areas_.size(), 9);
  for (Eigen::Index f = 0; f < areas_.size(); ++f) {
    const auto corner = topology_->faces().row(f);
    const Eigen::Map<const RowMatrix3> fluxes(corner_fluxes_.row(f).data());
    Eigen::Map<RowMatrix3> jacobian(result.row(f).data());
    jacobian = (shape.row(corner[1]) - shape.row(corner[0])).transpose() * fluxes.row(1);
    jacobian += (shape.row(corner[2]) - shape.row(corner[0])).transpose() * fluxes.row(2);
  }
  return result;
}

Vertices JacobianPoisson::weightedMeans(const Vertices& shape) const {
  Vertices means = Vertices::Zero(topology_->componentCount(), 3);
  for (Eigen::Index v = 0; v < shape.rows(); ++v) means.row(topology_->components()[v]) += shares_[v] * shape.row(v);
  return means;
}

}  // namespace shaped
