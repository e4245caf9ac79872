#pragma once

#include <vector>

#include "core/surface/point_tree.h"

namespace shaped {

/// Unit normals of a point cloud, N x 3: the direction in which each point's `neighbours` nearest points spread least
/// (principal component analysis; Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992). The sign is arbitrary. Zero where
/// the points leave the direction open (all on one line).
Vertices estimateNormals(const PointTree& cloud, int neighbours);

/// What makes a point of a cloud a boundary point.
struct RimOptions {
  int neighbours = 20;      ///< nearest points that are looked at, >= 3
  double widest_gap = 140;  ///< degrees between successive neighbours around the normal; a straight rim shows 180
};

/// Whether each point lies at the rim of the sampled surface: its neighbours, seen along its normal (N x 3, unit; zero
/// never lies at a rim), leave a gap wider than allowed. With `oriented` normals only neighbours that face the same way
/// count, so that the back of a thin part does not close the gap.
std::vector<bool> findRim(const PointTree& cloud, const Vertices& normals, bool oriented, const RimOptions& options);

}  // namespace shaped
