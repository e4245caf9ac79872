#pragma once

#include "core/model/shell_pga_training.h"
#include "tests/benchmark/experiments/data.h"

namespace shaped::experiments {

/// Trains with K = 4, 1000 coarse vertices and, where none is given, the default bending weight.
Solved<ShellPgaModelPtr> train(const DataSet& set, int modes, std::optional<double> bending = {});

/// Keeps a trained model for later rows; the newest of a name counts.
void keep(const std::string& model_name, const ShellPgaModel& model);

/// The kept model, or a new one, which is kept. The cache does not notice a change of the program: remove its folder,
/// or run row 5, which always trains. Throws std::runtime_error when training does not end with a model.
ShellPgaModelPtr keptOrTrained(const std::string& model_name, const DataSet& set, int modes);

/// The names that rows share.
inline constexpr const char* kAllBodies = "body-72";   ///< row 5, J = 20
inline constexpr const char* kMostBodies = "body-60";  ///< all but every sixth, J = 20

/// True for the poses of the body that kMostBodies has not seen.
inline bool heldOut(std::size_t pose) { return pose % 6 == 5; }

}  // namespace shaped::experiments
