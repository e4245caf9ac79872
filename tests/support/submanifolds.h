#pragma once

#include "core/editing/anchored_fit.h"
#include "core/statistics/submanifold.h"
#include "tests/support/training_set.h"

namespace shaped::test {

/// The submanifold of the first `modes` variations of variedTubes(), K = 2; 44 vertices.
std::shared_ptr<const Submanifold> tubeSubmanifold(int modes);

/// The shape of tangent coordinates [m].
Vertices shapeAt(const Submanifold& submanifold, const Eigen::VectorXd& coordinates);

/// An anchor at a vertex.
Anchor anchorAt(const Topology& topology, std::int32_t vertex);

/// Targets at the positions that vertices have on a shape.
std::vector<AnchorTarget> targetsOn(const Topology& topology, const Vertices& shape,
                                    const std::vector<std::int32_t>& vertices);

}  // namespace shaped::test
