#pragma once

#include <Eigen/Core>
#include <optional>
#include <stop_token>
#include <string>

#include "core/mesh/topology.h"
#include "core/numerics/solved.h"

namespace shaped {

/// The lowest eigenpairs of a surface's Laplacian, L phi = lambda M phi with the cotangent stiffness L and the lumped
/// areas M.
struct SurfaceSpectrum {
  Eigen::VectorXd eigenvalues;     ///< k values [1/m^2], ascending; the first are exactly 0, one for each component
  Eigen::MatrixXd eigenfunctions;  ///< V x k [1/m], orthonormal: Phi^T M Phi = I
  Eigen::VectorXd areas;           ///< V values [m^2]: the diagonal of M
};

struct SpectrumOptions {
  int count = 100;          ///< eigenpairs k, 1 to V
  double tolerance = 1e-8;  ///< of the residual, > 0
  int max_restarts = 200;   ///< of each Lanczos search, >= 1
  int max_searches = 50;    ///< >= 2: the last one finds nothing that was missing

  /// "count = 0, want 1 to 642"; empty when all is well.
  std::optional<std::string> firstViolation(std::int32_t vertex_count) const;
};

/// Eigenpairs by the Lanczos method on M^1/2 (L + s M)^-1 M^1/2 with s = 1 / area, which is positive definite. The
/// constants of each component are put in as they are known, and the method runs in what is left. It may meet only some
/// of the functions that share an eigenvalue (on symmetric surfaces, or on several alike), so it searches again beside
/// those found until nothing below the last eigenvalue turns up. Meshes of up to 256 or 4 k vertices are solved densely.
///
/// A function's sign is chosen so that the first vertex that has more than half its largest magnitude is positive; of
/// functions that share an eigenvalue any orthonormal basis may come. The same input gives the same numbers.
///
/// residual: the largest |L phi - lambda M phi| in the norm of M^-1, relative to the largest eigenvalue (or to 1 / area
/// where all are 0): within that share of it, each is an eigenvalue. kIterationLimit and kCancelled leave the pairs
/// found so far, perhaps fewer than k and with some missing between; kNumericalFailure (slivers) leaves the constants.
/// Throws InvalidInput when the shape is not valid for the topology (requireValidShape) or an option is out of range.
Solved<SurfaceSpectrum> surfaceSpectrum(const Topology& topology, const Vertices& shape,
                                        const SpectrumOptions& options = {}, const std::stop_token& stop = {});

}  // namespace shaped
