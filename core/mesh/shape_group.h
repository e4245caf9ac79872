#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// The positions of n shapes that share a topology, stored so that one vertex of all shapes is contiguous: what a
/// groupwise edge collapse reads. Each shape is centred, so that quadrics far from the origin lose no digits.
class ShapeGroup {
 public:
  using Values = Eigen::ArrayXd;  ///< one value per shape

  /// shapes: n >= 1, all V x 3.
  explicit ShapeGroup(const std::vector<Vertices>& shapes);

  Eigen::Index size() const { return coordinates_.rows(); }
  /// Coordinate `axis` of vertex `v` in every shape.
  auto coordinate(std::int32_t v, int axis) const { return coordinates_.col(3 * v + axis); }
  Eigen::RowVector3d position(Eigen::Index shape, std::int32_t v) const {
    return {coordinates_(shape, 3 * v), coordinates_(shape, 3 * v + 1), coordinates_(shape, 3 * v + 2)};
  }

 private:
  Eigen::ArrayXXd coordinates_;  ///< n x 3V
};

}  // namespace shaped
