#pragma once

#include "core/model/shell_pga_model.h"
#include "core/numerics/progress.h"

namespace shaped {

struct EvaluationOptions {
  std::vector<int> modes;        ///< dimensions to evaluate, each 1 .. J; empty: 1, 2, 3, 5, 8, 12, .. up to J
  int folds = 0;                 ///< 0: leave one out; f >= 2: leave every f-th out, f trainings instead of n
  int specificity_samples = 20;  ///< random shapes drawn from the model per dimension, >= 0
  unsigned seed = 1;
  std::stop_token stop;
};

/// Error of representing shapes that were left out of training.
struct GeneralisationError {
  double elastic = 0;  ///< mean of sqrt(W[s, P[s]]), the model's own distance [m]
  double vertex = 0;   ///< mean over shapes of the root mean square vertex distance after rigid alignment [m]
};

/// Quality of a model per number of modes, on its coarse mesh.
struct ShellPgaEvaluation {
  std::vector<int> modes;
  std::vector<double> compactness;                  ///< share of the training variance captured, in [0, 1]
  std::vector<GeneralisationError> generalisation;  ///< of Shell PGA
  std::vector<GeneralisationError> linear;          ///< of linear PCA of aligned vertices at equal dimension
  std::vector<double> specificity;                  ///< mean elastic distance of random model shapes to the nearest of `shapes` [m]
};

/// Evaluates a model on full-resolution shapes of its topology, usually its training shapes: retrains without each fold
/// with the model's own K and bending weight, and projects what was left out. Long for many shapes: watch `progress`.
/// Throws InvalidInput naming shapes[i], "modes[i]" or "folds"; needs at least three shapes.
Solved<ShellPgaEvaluation> evaluate(const ShellPgaModel& model, const std::vector<Vertices>& shapes,
                                    const EvaluationOptions& options, const ProgressSink& progress);

}  // namespace shaped
