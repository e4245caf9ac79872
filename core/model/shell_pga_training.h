#pragma once

#include "core/model/shell_pga_checkpoint.h"
#include "core/model/shell_pga_model.h"
#include "core/numerics/progress.h"

namespace shaped {

struct ShellPgaTrainingOptions {
  int modes = 20;                 ///< J, number of principal variations, 1 .. n - 1
  int path_steps = 4;             ///< K of each discrete geodesic, >= 1
  std::optional<double> bending;  ///< eta [m^2], > 0; default 2.5e-5 times the first shape's squared diameter
  /// Of the squared distance in paths, mean and Gram matrix. Symmetric: they converge with second order in 1/K;
  /// directed: as [HZRS18] has it, with first order.
  EnergySymmetry symmetry = EnergySymmetry::kSymmetric;
  int coarse_vertices = 1000;  ///< solve on a mesh of at most this many vertices, >= 50
  double tolerance = 1e-8;     ///< of the Frechet mean: largest relative force imbalance, > 0
  int iterations = 100;        ///< limit for the Frechet mean's Newton steps, >= 1

  /// "path_steps = 0, want >= 1"; empty when all is well.
  std::optional<std::string> firstViolation(int training_shapes) const;
};

struct ShellPgaTrainingSet {
  TopologyPtr topology;
  std::vector<Vertices> shapes;            ///< n >= 2, each V x 3, in any position
  std::optional<Vertices> template_shape;  ///< V x 3; the first shape where not given
};

/// Keeps a training across processes.
struct ShellPgaResumption {
  CheckpointSink checkpoint;                 ///< may be empty
  const ShellPgaCheckpoint* from = nullptr;  ///< where to go on; null: from the beginning
};

/// What ties a checkpoint to its training: a hash of shapes and options.
std::string trainingFingerprint(const ShellPgaTrainingSet& set, const ShellPgaTrainingOptions& options);

/// Trains a model: coarsens all shapes together, then mean, Gram matrix and principal variations on the coarse mesh,
/// and learns the prolongation. Throws InvalidInput naming the option, "topology" or shapes[i]: fewer than two shapes,
/// a wrong vertex count, a degenerate triangle, several components, two shapes alike up to a rigid motion.
/// The solution is null when the computation was cancelled or failed before there were principal variations; otherwise
/// the outcome says whether mean and variations converged. Runs parallel loops in the calling thread's TBB arena.
/// Resumed from a checkpoint, it goes on as if it had not been interrupted and gives the same model. Throws
/// InvalidInput naming "checkpoint" when that is of another training.
Solved<ShellPgaModelPtr> trainShellPga(const ShellPgaTrainingSet& set, const ShellPgaTrainingOptions& options,
                                       const ProgressSink& progress, std::stop_token stop,
                                       const ShellPgaResumption& resumption = {});

}  // namespace shaped
