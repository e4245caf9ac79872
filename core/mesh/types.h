#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace shaped {

/// Vertex positions, V x 3, row-major, metres.
using Vertices = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Triangles, F x 3 vertex indices, counter-clockwise seen from outside.
using Faces = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace shaped
