#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <stop_token>

#include "core/mesh/coarse_frame.h"
#include "core/mesh/coarsening.h"
#include "core/mesh/surface_neighbours.h"
#include "core/numerics/scalar_cholesky.h"

namespace shaped {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Memory of a sparse matrix's entries and indices [bytes].
template <int options>
std::size_t bytesOf(const Eigen::SparseMatrix<double, options>& matrix) {
  return static_cast<std::size_t>(matrix.nonZeros()) * (sizeof(double) + sizeof(int)) +
         static_cast<std::size_t>(matrix.outerSize() + 1) * sizeof(int);
}

/// The fine shape whose Laplacian is the reference's, turned and stretched as the coarse shape around it was, and which
/// passes through the coarse vertices: argmin over x of |L x - d|^2 in M^-1, x = c on the kept vertices.
///
/// L: cotangent Laplacian of the reference (weights clamped to [0.05, 5]), M its lumped areas. d is the Laplacian of
/// the reference's edges, each mapped by the gradients (gradientStencils) of the coarse vertices around it, blended by
/// weights 1/distance - 1/radius over the six nearest along the surface. All of it is linear in the frame vectors, so
/// one factorisation serves every shape.
///
/// Minimising |L x - d| rather than solving L x = d is what keeps the surface smooth at the kept vertices: with them as
/// hard constraints, the Poisson solution has a cusp at each (half as much error again on held-out bodies).
class ThinPlate {
 public:
  /// neighbours: of each fine vertex among the kept ones, seven or more where the mesh has as many; more do not count.
  /// Null once the stop token has fired. Throws InvalidInput naming `reference` when its triangles are too thin to
  /// factorise.
  static std::shared_ptr<const ThinPlate> make(const Topology& fine, const Coarsening& coarsening,
                                               const Vertices& reference,
                                               const std::vector<SurfaceNeighbours>& neighbours,
                                               const std::stop_token& stop = {});

  /// frame: frameVectors of a coarse shape. V x 3. May be called from several threads at once.
  Vertices solve(const Vertices& frame) const;

  /// Memory of the matrix and the factor [bytes].
  std::size_t bytes() const;

 private:
  ThinPlate(const Topology& fine, const Coarsening& coarsening);
  /// False once the stop token has fired.
  bool assemble(const Topology& fine, const Coarsening& coarsening, const Vertices& reference,
                const std::vector<SurfaceNeighbours>& neighbours, const std::stop_token& stop);

  std::vector<std::int32_t> kept_, free_;  ///< fine vertices
  SparseRows pull_;                        ///< free x 2C: the right-hand side from the frame vectors
  ScalarCholesky factor_;
};

}  // namespace shaped
