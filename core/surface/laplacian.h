#pragma once

#include <Eigen/SparseCore>

#include "core/mesh/types.h"

namespace shaped {

/// What an obtuse corner, whose cotangent is negative, contributes to a stiffness matrix.
enum class ObtuseCorners {
  kAsTheyAre,  ///< the finite elements' own weights: right for functions, but a solution may overshoot its data
  kAsZero,     ///< no weight is negative, so solutions stay within their data (a discrete maximum principle)
};

/// Stiffness matrix of piecewise linear functions on a triangle mesh [Pinkall and Polthier 1993]: V x V, symmetric,
/// positive semi-definite, rows summing to 0, without unit, with
///   u^T L u = integral of |grad u|^2 = sum over triangles and their corners of cot(corner) / 2 (u_i - u_j)^2,
/// i and j the two other corners. Its null space is the functions constant on each component.
///
/// Where a triangle's area is below 1e-12 of its longest edge squared, the cotangents are those for that area, all
/// three scaled alike, so that entries stay finite and the matrix semi-definite; a triangle that is a point counts as
/// nothing. Throws InvalidInput when there is no face, an index is out of range or a coordinate is not finite.
Eigen::SparseMatrix<double> cotangentStiffness(const Vertices& vertices, const Faces& faces,
                                               ObtuseCorners obtuse = ObtuseCorners::kAsTheyAre);

/// Lumped mass: a third of the area of the triangles around each vertex, V values [m^2], summing to the surface's area.
/// 0 where a vertex has no triangle with area. Throws as cotangentStiffness does.
Eigen::VectorXd lumpedAreas(const Vertices& vertices, const Faces& faces);

}  // namespace shaped
