#pragma once

#include <optional>
#include <vector>

#include "core/mesh/types.h"
#include "core/sample/random.h"

namespace shaped {

/// A ball in which no point is left.
struct ScanHole {
  Eigen::RowVector3d centre;
  double radius;  ///< m
};

/// A half-space in which no point is left: normal . x > offset.
struct ScanCut {
  Eigen::RowVector3d normal;  ///< unit
  double offset;              ///< m
};

/// Which points a cut in a random direction takes: `count` of them, the farthest that way. left: one flag a point, true
/// while it is there; more than `count` are. Nothing when count is 0.
std::optional<ScanCut> cutAway(const Vertices& points, Eigen::Index count, Random& random, std::vector<bool>& left);

/// Punches balls around random points that are left, of 0.5 to 1.5 times `radius`, until `count` points are gone; the
/// last ball is made smaller so that it takes no more. left: as above.
std::vector<ScanHole> punchHoles(const Vertices& points, Eigen::Index count, double radius, Random& random,
                                 std::vector<bool>& left);

}  // namespace shaped
