#pragma once

#include "core/curve/reduced_path.h"
#include "core/shell/structure.h"

namespace shaped {

struct PathEnrichment {
  int added = 0;  ///< directions
  /// How far the full problem's paths are from these, predicted: the norm of the displacements over that of the frames.
  double missing = 0;
  double residual = 0;  ///< the largest of FlowTangents::residual

  /// Whether a further one may help: this one added something, and less is missing than before the last one.
  bool worthAnother(const PathEnrichment& last) const;
};

/// Adds to a subspace where the full problem would move the inner frames of settled paths in it: the principal
/// directions of FlowTangents::displacements, at most eight of them. Nothing once these are below `tolerance`, or the
/// stop token has fired. The step beyond [BvTH16], whose subspace is made before the path is known.
PathEnrichment enrich(const ShellStructurePtr& structure, double bending, GhostSpace& space,
                      const std::vector<PathCoordinates>& paths, double tolerance, const std::stop_token& stop = {});

}  // namespace shaped
