#pragma once

#include "core/body/body_model.h"
#include "core/model/shell_pga_model.h"

namespace shaped::fuzz {

/// A model by construction rather than training: a sphere of 42 vertices over one of 12, two modes that stretch it.
ShellPgaModelPtr smallModel();

/// A body of two joints and two modes on 42 vertices, with limits.
const BodyModel& smallBody();

}  // namespace shaped::fuzz
