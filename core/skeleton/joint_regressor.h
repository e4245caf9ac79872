#pragma once

#include "core/skeleton/rig.h"

namespace shaped {

/// Joints out of vertices: J x V, r_j = sum_v R_jv v. Rows sum to 1, so joints follow every affine motion of the mesh.
using JointRegressor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// The regressor of a rig in its mesh. Each joint is an affine combination of the vertices where its bone and its
/// parent's meet (by w_j w_parent; for the root, of its own and its children's bones); where they share none, of all
/// that the bone carries. Of the combinations that give the rig's joint exactly, the one nearest to the cluster's
/// weighted mean; where the cluster cannot reach the joint (all its vertices in one plane), the least squares answer. A
/// bone without vertices takes its parent's cluster, the root then its first child's.
/// rest: V x 3, the mesh that the rig was made for. Throws InvalidInput when the rig does not fit it.
JointRegressor clusterRegressor(const Rig& rig, const Vertices& rest);

}  // namespace shaped
