#pragma once

#include <vector>

#include "core/skeleton/rig.h"

namespace shaped {

/// How far each joint reaches: the largest distance [m] from it to a vertex that it or a joint below it carries
/// foremost, 0 where there is none. rest: V x 3; joints: J x 3, where they lie in it.
std::vector<double> jointReach(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& rest,
                               const Vertices& joints);

}  // namespace shaped
