#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/mesh/topology.h"

namespace shaped {

/// A marked vertex and how far it is along the surface's edges.
struct SurfaceNeighbour {
  std::int32_t mark;  ///< position in the list of marked vertices
  double distance;    ///< [m]
};

/// The marked vertices nearest to one vertex, nearest first.
using SurfaceNeighbours = std::vector<SurfaceNeighbour>;

/// For every vertex of a shape the `count` marked vertices that are nearest along its edges (fewer where its component
/// has fewer). Along the surface and not through space: the next finger is far away. marked: distinct vertices. Empty
/// once the stop token has fired.
std::vector<SurfaceNeighbours> nearestMarked(const Topology& topology, const Vertices& shape,
                                             const std::vector<std::int32_t>& marked, int count,
                                             const std::stop_token& stop = {});

}  // namespace shaped
