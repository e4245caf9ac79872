#pragma once

#include <functional>

#include "core/sample/marching_tetrahedra.h"

namespace shaped {

struct RemeshingOptions {
  int rounds = 6;         ///< of split, collapse, flip and relax, >= 1
  int final_rounds = 10;  ///< of flip and relax alone, >= 0
};

/// Makes the triangles of a closed mesh nearly equilateral, with edges of the length that a function asks for at each
/// place: long edges are split, short ones collapsed, edges flipped towards six neighbours, vertices moved along the
/// surface to the centre of their neighbours and put back on it [Botsch and Kobbelt 2004, "A remeshing approach to
/// multiresolution modeling"]. The topology of the surface is kept.
/// edge_length: m, > 0, slowly varying; project: the surface point for a point near it.
SurfaceMesh remeshIsotropically(const SurfaceMesh& mesh,
                                const std::function<double(const Eigen::Vector3d&)>& edge_length,
                                const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& project,
                                const RemeshingOptions& options = {});

}  // namespace shaped
