#pragma once

#include <Eigen/Core>
#include <memory>
#include <stop_token>

#include "core/mesh/topology.h"
#include "core/numerics/scalar_cholesky.h"

namespace shaped {

/// A 3 x 3 matrix for each triangle, F x 9: row f holds J_f row by row. J_f maps directions of the source's triangle to
/// directions of the shape's; without unit.
using Jacobians = Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>;

/// From a field of Jacobians over a source shape to the shape that has them as nearly as can be, and back: the
/// differentiable layer of neural Jacobian fields [Aigerman et al. 2022; Muralikrishnan 2025, section 3.3.3
/// and eq. 4.2].
///
/// A shape x (V x 3) has on each triangle J_f = sum over its corners x_c (grad phi_c)^T, with the gradients of the
/// source's hat functions: the affine map of the triangle within its plane, which sends the source's normal to zero.
/// The source itself has the projections I - n n^T. Jacobians J are answered by the x that minimises
///   sum_f A_f |J_f - sum_c x_c (grad phi_c)^T|^2,
/// A_f the source's areas: the Poisson equation L x = sum_f A_f J_f grad phi_c with the cotangent stiffness L of the
/// source. What J does along the normal makes no difference. Positions are free up to a translation of each component,
/// which its centroid settles: the mean of its vertices weighted by the source's lumped areas, a linear function of x.
///
/// Factorised once; immutable, and every method may be called from several threads at once.
class JacobianPoisson {
 public:
  /// Null once the stop token has fired. Throws InvalidInput naming `source` when it is not a valid shape of the
  /// topology (requireValidShape) or its triangles are too thin to factorise.
  static std::shared_ptr<const JacobianPoisson> make(TopologyPtr topology, const Vertices& source,
                                                     const std::stop_token& stop = {});

  /// The shape of a field of Jacobians, V x 3, in the source's unit, components centred where the source's are. Throws
  /// InvalidInput naming `jacobians` when there are not F of them or one is not finite.
  Vertices solve(const Jacobians& jacobians) const;
  /// The same centred elsewhere. centroids: one row a component, C x 3. Throws InvalidInput naming `centroids` too.
  Vertices solve(const Jacobians& jacobians, const Vertices& centroids) const;

  /// dE/dJ, F x 9, from the gradient dE/dx (V x 3) of a function E of the solution: the transposed linear map of solve,
  /// <solve(J) - solve(0), g> = <J, backward(g)>, by the same factor. Throws InvalidInput naming `gradient` when it has
  /// another count of rows or is not finite.
  Jacobians backward(const Vertices& gradient) const;

  /// The Jacobians of a shape, V x 3. solve() answers them with the shape, up to its components' places. Throws
  /// InvalidInput naming `shape` when it has another count of vertices or is not finite.
  Jacobians jacobians(const Vertices& shape) const;

  /// Centroids of a shape's components, C x 3. Throws InvalidInput as jacobians() does.
  Vertices centroids(const Vertices& shape) const;

  const Topology& topology() const { return *topology_; }
  /// Of the source's triangles, F values [m^2]: the weights of the fit, and of a loss on Jacobians.
  const Eigen::VectorXd& areas() const { return areas_; }
  /// Memory of the factor and the gradients [bytes].
  std::size_t bytes() const;

 private:
  JacobianPoisson(TopologyPtr topology, const Vertices& source);
  Vertices divergence(const Jacobians& jacobians) const;
  Jacobians gradients(const Vertices& shape) const;
  Vertices weightedMeans(const Vertices& shape) const;

  TopologyPtr topology_;
  Eigen::VectorXd areas_;      ///< F
  Jacobians corner_fluxes_;    ///< F x 9: A_f grad phi_c of the three corners one after another [m]
  Eigen::VectorXd shares_;     ///< V: each vertex's share of its component's area, summing to 1 in each
  Vertices source_centroids_;  ///< C x 3
  ScalarCholesky factor_;
};

}  // namespace shaped
