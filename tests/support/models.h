#pragma once

#include "core/model/shell_pga_model.h"

namespace shaped::test {

/// A small Shell PGA model of bent tubes, 162 vertices, trained on first use and kept.
ShellPgaModelPtr tubeModel();

/// A tube of the model's topology, bent by an angle [rad].
Vertices bentTube(double angle);

}  // namespace shaped::test
