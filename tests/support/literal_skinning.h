#pragma once

#include "core/skeleton/rig.h"

namespace shaped::test {

/// Linear blend skinning as its formula says it, vertex by vertex: x = sum_j w_j (G_j (v - r_j) + p_j).
Vertices skinLiterally(const Rig& rig, const Vertices& vertices, const Pose& pose);

}  // namespace shaped::test
