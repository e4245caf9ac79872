#pragma once

#include <optional>

#include "core/model/shell_pga_model.h"
#include "core/numerics/progress.h"

namespace shaped {

struct ShellPgaTrainingOptions {
  int modes = 20;                 ///< J, number of principal variations, 1 .. n - 1
  int path_steps = 4;             ///< K of each discrete geodesic, >= 1
  std::optional<double> bending;  ///< eta [m^2], > 0; default 2.5e-5 times the first shape's squared box diagonal
  int coarse_vertices = 1000;     ///< solve on a mesh of at most this many vertices, >= 50
  double tolerance = 1e-6;        ///< of the Frechet mean: relative gradient norm, > 0
  int iterations = 100;           ///< limit for the Frechet mean, >= 1

  /// "path_steps = 0, want >= 1"; empty when all is well.
  std::optional<std::string> firstViolation(int training_shapes) const;
};

/// Trains a model. Throws InvalidInput for bad options or shapes (field "shapes[i]"): fewer than two, wrong vertex
/// count, a degenerate triangle, several components, two shapes alike up to a rigid motion. The solution is null only
/// when cancelled before there was anything to keep. Runs parallel loops in the calling thread's TBB arena.
Solved<ShellPgaModelPtr> trainShellPga(TopologyPtr topology, const std::vector<Vertices>& shapes,
                                       const ShellPgaTrainingOptions& options, const ProgressSink& progress,
                                       std::stop_token stop);

/// Throws InvalidInput when a handle's vertex is out of range or repeated, a position is not finite, there are fewer
/// than three handles, or they lie on one line.
Solved<ShellPgaEdit> edit(const ShellPgaModel& model, const std::vector<Handle>& handles, const EditOptions& options);

/// (17)-(20) of [HZRS18]. Throws InvalidInput when the shape has the wrong vertex count or a degenerate triangle.
Solved<ShellPgaProjection> project(const ShellPgaModel& model, const Vertices& shape, const ProjectionOptions& options);

/// The full-resolution shape of coefficients. Throws InvalidInput when alpha has the wrong size, a negative entry or
/// another sum than 1 (within 1e-6), or scale <= 0.
Solved<Vertices> synthesize(const ShellPgaModel& model, const ShellPgaCoefficients& coefficients, std::stop_token stop);

/// Leave-one-out over `shapes` (the training shapes, or others of the same connectivity).
Solved<ShellPgaEvaluation> evaluate(const ShellPgaModel& model, const std::vector<Vertices>& shapes,
                                    const EvaluationOptions& options, const ProgressSink& progress);

}  // namespace shaped
