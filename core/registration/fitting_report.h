#pragma once

#include "core/registration/template_fitting.h"

namespace shaped {

/// Looks at a fitted template: its distances under the gates, its triangles against those of `placed`.
FittingReport reportFit(const ScanSurface& scan, const Topology& topology, const Vertices& placed,
                        const Vertices& fitted, const CorrespondenceGates& gates);

/// Triangles whose normal points against the mean of their corners' in `shape` but not in `reference`.
Eigen::Index flippedTriangles(const Faces& faces, const Vertices& reference, const Vertices& shape);

/// |part along n|^2 + (1 - sliding) |part across|^2 of a difference; all of it where the normal is zero.
double slidingSquare(const Eigen::RowVector3d& difference, const Eigen::RowVector3d& normal, double sliding);

}  // namespace shaped
