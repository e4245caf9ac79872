#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace shaped {

/// The 60 rotations of the icosahedron: no rotation is further than 45 degrees from one of them. They form a group that
/// holds the half turns about x, y and z.
std::vector<Eigen::Matrix3d> icosahedralRotations();

/// Angle of the rotation that takes one into the other, in [0, pi].
double angleBetween(const Eigen::Matrix3d& one, const Eigen::Matrix3d& other);

}  // namespace shaped
