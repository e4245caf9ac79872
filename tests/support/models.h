#pragma once

#include "core/model/shell_pga_model.h"
#include "core/model/shell_pga_training.h"

namespace shaped::test {

/// A small Shell PGA model of bent tubes, 162 vertices, trained on first use and kept.
ShellPgaModelPtr tubeModel();

/// A tube of the model's topology, bent by an angle [rad].
Vertices bentTube(double angle);

/// Four tubes bent by -0.9 to 0.8 radians, one of them wider: a training of a fraction of a second with
/// smallTraining().
ShellPgaTrainingSet fourTubes();
/// J = 2, K = 2, at most 60 coarse vertices.
ShellPgaTrainingOptions smallTraining();

}  // namespace shaped::test
