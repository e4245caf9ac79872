#pragma once

#include "core/statistics/gram.h"

namespace shaped {

/// The statistics that a Shell PGA model consists of, on one mesh.
struct ShellPga {
  Vertices mean;                     ///< Frechet mean (10)
  Eigen::VectorXd eigenvalues;       ///< all n of the Gram matrix, falling [m^2]
  Eigen::MatrixXd eigenvectors;      ///< n x J, orthonormal columns
  std::vector<Vertices> variations;  ///< p_1 .. p_J (14), then their reflections p_-1 .. p_-J
  int path_steps = 4;                ///< K

  int modes() const { return static_cast<int>(variations.size() / 2); }
};

/// Principal variations (14) of the J dominant eigenvectors and their reflections I(mean, p_j, -1).
///
/// Weights are |w_ji| scaled to sum 1; where w_ji < 0 the arm's first node is replaced by its reflection at the mean. A
/// variation lies one step 1/K from the mean, so one step of (23) reflects it. J in 1 .. n - 1, else InvalidInput naming
/// "modes". Runs parallel loops in the current TBB arena.
Solved<ShellPga> principalVariations(const GeodesicCalculus& calculus, const Spider& spider, int modes,
                                     const GeodesicOptions& options);

}  // namespace shaped
