#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/mesh/shape_stack.h"
#include "core/statistics/gram.h"

namespace shaped {

/// The statistics that a Shell PGA model consists of, on one mesh.
struct ShellPga {
  Vertices mean;                 ///< Frechet mean (10)
  Eigen::VectorXd eigenvalues;   ///< all n of the Gram matrix, falling [m^2]
  Eigen::MatrixXd eigenvectors;  ///< n x J, orthonormal columns
  ShapeStack variations;         ///< p_1 .. p_J (14), then their reflections p_-1 .. p_-J
  int path_steps = 4;            ///< K

  int modes() const { return static_cast<int>(variations.size() / 2); }
};

/// What principalVariations() has done. Every item depends on the spider and, a variation, on all Gram rows and
/// reflections alone: whichever are missing are computed, and come out the same.
struct VariationsProgress {
  std::vector<std::optional<Eigen::VectorXd>> gram_rows;   ///< n, as GramEnergies::row()
  std::vector<std::optional<Solved<Vertices>>> reflected;  ///< n, I(mean, s_1^i, -1)
  std::vector<std::optional<Solved<Vertices>>> forward;    ///< J, p_j
  std::vector<std::optional<Solved<Vertices>>> backward;   ///< J, p_-j
};

/// Keeps principal variations across interruptions.
struct VariationsResumption {
  const VariationsProgress* from = nullptr;  ///< of the same spider and J; null: nothing is done
  /// Hears of every item when it is done, and of all once more when the stop token has fired. From any thread, one call
  /// at a time; may be empty.
  std::function<void(const VariationsProgress&)> on_item = {};
};

/// Principal variations (14) of the J dominant eigenvectors and their reflections I(mean, p_j, -1).
///
/// Weights are |w_ji| scaled to sum 1; where w_ji < 0 the arm's first node is replaced by its reflection at the mean. A
/// variation lies one step 1/K from the mean, so one step of (23) reflects it. J in 1 .. n - 1, else InvalidInput
/// naming "modes". Runs parallel loops in the current TBB arena. Cancelled, the solution has no variations.
Solved<ShellPga> principalVariations(const GeodesicCalculus& calculus, const Spider& spider, int modes,
                                     const GeodesicOptions& options, const VariationsResumption& resumption = {});

}  // namespace shaped
