#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "core/mesh/surface_neighbours.h"
#include "core/mesh/thin_plate.h"

namespace shaped {

/// One shape as the fit sees it.
struct DetailSample {
  Vertices frame;    ///< 2C x 3, frameVectors of its coarse shape
  Vertices missing;  ///< V x 3, what a prolongation must still add to reproduce it
};

/// Fits the linear map (V x 2C) from frame vectors to what is missing. Each fine vertex has its own ridge regression
/// over the positions of the 16 and the normals of the 8 coarse vertices nearest to it along the surface:
/// min_w sum_s |F_s w - y_s|^2 + 1e-3 (n + 8) h^2 |w|^2, h the distance to the seventh of them, with the position
/// weights summing to 0 (rigid motions stay exact) and F_0 w = y_0 (the reference is reproduced exactly).
///
/// neighbours: of each fine vertex among the coarse ones, nearest first. A vertex at distance 0 of the first is kept
/// and gets no weights. training may be empty: then the smallest weights that reproduce the reference.
/// Nothing once the stop token has fired.
std::optional<SparseRows> fitDetail(const std::vector<SurfaceNeighbours>& neighbours, const DetailSample& reference,
                                    const std::vector<DetailSample>& training, const std::stop_token& stop = {});

}  // namespace shaped
