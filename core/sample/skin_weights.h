#pragma once

#include <vector>

#include "core/mesh/types.h"
#include "core/sample/anatomy.h"

namespace shaped {

/// Skin weights by heat diffusion: each vertex is held at its nearest bone, more firmly the closer it lies, and the
/// weights are the equilibrium of heat along the surface [Baran and Popovic 2007, section 4].
/// Returns V x B, smooth, non-negative, rows summing to 1. The mesh is closed and in the rest pose of the bones.
Eigen::MatrixXd heatSkinWeights(const Vertices& vertices, const Faces& faces, const std::vector<Bone>& bones);

}  // namespace shaped
