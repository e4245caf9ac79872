#pragma once

#include "core/model/shell_pga_model.h"

namespace shaped::fuzz {

/// A model by construction rather than training: a sphere of 42 vertices over one of 12, two modes that stretch it.
ShellPgaModelPtr smallModel();

}  // namespace shaped::fuzz
