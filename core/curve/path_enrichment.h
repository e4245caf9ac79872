#pragma once

#include "core/curve/reduced_path.h"
#include "core/shell/structure.h"

namespace shaped {

struct PathEnrichment {
  int added = 0;  ///< directions
  /// How far the full problem's paths are from these, predicted: the norm of the displacements over that of the frames.
  double missing = 0;
  double residual = 0;  ///< the largest of FlowTangents::residual
};

/// Adds to a subspace where the full problem would move the inner frames of settled paths in it: the principal
/// directions of FlowTangents::displacements, at most so many of them. Nothing once they are below `tolerance`, or
/// the stop token has fired. The step beyond [BvTH16], whose subspace is made before the path is known.
PathEnrichment enrich(const ShellStructurePtr& structure, double bending, GhostSpace& space,
                      const std::vector<PathCoordinates>& paths, double tolerance, int most,
                      const std::stop_token& stop = {});

}  // namespace shaped
