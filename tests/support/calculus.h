#pragma once

#include "core/geodesic/geodesic.h"
#include "tests/support/shapes.h"

namespace shaped::test {

/// Geodesic calculus on a mesh with its default bending weight.
GeodesicCalculus calculusOn(const Mesh& mesh);

/// Rolls a flat sheet (z = 0) out of its plane by `angle` radians along x.
Vertices curl(const Vertices& sheet, double angle);

/// The largest distance of corresponding vertices after the best rigid motion [m].
double rigidGap(const Vertices& a, const Vertices& b);

/// log2 of the ratio of two errors: the order of convergence where the second has half the step.
double order(double coarse_error, double fine_error);

/// Largest over smallest energy of a path's segments: 1 at constant speed.
double speedRatio(const GeodesicCalculus& calculus, const Path& path);

}  // namespace shaped::test
