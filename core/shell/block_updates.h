#pragma once

#include <Eigen/Core>

namespace shaped {

/// block += a b^T for a column-major 3 x 3 block. (Eigen evaluates such a product into a temporary, whose reloading in
/// other widths than it was stored in stalls the processor.)
inline void addOuter(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double* block) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) block[3 * c + r] += a[r] * b[c];
}

}  // namespace shaped
