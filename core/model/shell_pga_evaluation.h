#pragma once

#include <filesystem>
#include <functional>

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

/// What an evaluation has reached: all that is needed to go on from there in another process.
struct ShellPgaEvaluationState {
  std::optional<Spider> spider;  ///< of all shapes; none: nothing is done
  Outcome outcome;               ///< of all that is done
  int folds = 0;                 ///< that are done
  ShellPgaEvaluation sums;       ///< the errors of these folds; the specificity of the dimensions that are done

  /// For people: "fold 3 done".
  std::string stage() const;
};

/// Keeps an evaluation across processes.
struct ShellPgaEvaluationResumption {
  /// Is offered the state when there is something new in it, from one thread. May be empty.
  std::function<void(const ShellPgaEvaluationState&)> checkpoint = {};
  const ShellPgaEvaluationState* from = nullptr;  ///< of the same model, shapes and options; null: from the beginning
};

/// Throws what evaluate() would throw for so many shapes, but for the shapes themselves.
void requireEvaluable(const ShellPgaModel& model, std::size_t shapes, const EvaluationOptions& options);

/// Evaluates a model on full-resolution shapes of its topology, usually its training shapes: retrains without each fold
/// with the model's own K and bending weight, and projects what was left out. Long for many shapes: watch `progress`.
/// Resumed, it gives the numbers of an evaluation that was not interrupted.
/// Throws InvalidInput naming shapes[i], "modes[i]" or "folds"; needs at least three shapes.
Solved<ShellPgaEvaluation> evaluate(const ShellPgaModel& model, const std::vector<Vertices>& shapes,
                                    const EvaluationOptions& options, const ProgressSink& progress,
                                    const ShellPgaEvaluationResumption& resumption = {});

/// Writes the file; it appears only when complete. Throws FileError.
void writeEvaluationState(const std::filesystem::path& path, const ShellPgaEvaluationState& state);

/// Throws InvalidInput naming the file and what is wrong when it is damaged, of another format, or no such state.
ShellPgaEvaluationState readEvaluationState(const std::filesystem::path& path);

}  // namespace shaped
