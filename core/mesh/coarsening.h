#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/mesh/topology.h"

namespace shaped {

/// A coarse mesh whose vertices are some of the fine ones.
struct Coarsening {
  TopologyPtr coarse;
  std::vector<std::int32_t> kept;  ///< fine vertex of each coarse one, ascending
};

struct CoarseningOptions {
  std::int32_t vertex_count = 1000;              ///< target, >= 4
  std::vector<std::int32_t> protected_vertices;  ///< fine vertices that stay, for example those under markers
  std::stop_token stop;                          ///< fired: ends soon with a valid mesh of no particular quality
};

/// Coarsens all shapes at once by half-edge collapse, cheapest first, so that the coarse shapes keep their
/// correspondence and each approximates its fine one.
///
/// A collapse costs the summed quadric error of all shapes ([GH97], groupwise as in [MG03]; GroupQuadrics) times the
/// square of the factor by which it lowers the smallest regularity of the surface around it (CollapseProbe). None
/// changes the surface's genus, opens or closes a boundary, turns a triangle of any shape by more than 70 degrees (unless
/// it unfolds it), or leaves thin or folded triangles in a shape that was better there. Where that rule leaves no way to the target it is
/// relaxed step by step; where nothing can be collapsed any more (or too many vertices are protected) the result has
/// more vertices than asked for. A mesh with at most the target is kept whole. Same input, same result.
///
/// shapes: n >= 1, each V x 3 and valid (requireValidShape). Scratch: 104 n V bytes.
/// Throws InvalidInput naming `shapes[i]`, `vertex_count` or `protected_vertices[i]`.
Coarsening coarsen(const TopologyPtr& fine, const std::vector<Vertices>& shapes, const CoarseningOptions& options = {});

/// The coarse shape of a fine one: its kept rows. Throws InvalidInput naming `shape` when it has too few vertices.
Vertices restrictTo(const Coarsening& coarsening, const Vertices& fine);

}  // namespace shaped
