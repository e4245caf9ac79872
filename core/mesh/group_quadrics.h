#pragma once

#include <Eigen/Core>

#include "core/mesh/shape_group.h"
#include "core/mesh/topology.h"

namespace shaped {

/// Quadric error of every vertex in every shape of a group: the squared distance to the planes of its faces, weighted
/// by a third of their area [GH97], kept per shape and summed over the group [MG03].
///
/// Two more terms: planes upright on boundary edges (weight 10 times the squared edge length), so that boundaries keep
/// their course; and the squared distance to the vertex itself (weight 0.01 of the planes'), so that where the surface
/// is flat and the planes say nothing, the coarse vertices spread evenly.
class GroupQuadrics {
 public:
  GroupQuadrics(const Topology& topology, const ShapeGroup& shapes);

  /// What it costs to let vertex `to` stand for `from` too: the sum over the shapes of both quadrics at `to`, m^4, >=
  /// 0.
  double collapseError(const ShapeGroup& shapes, std::int32_t from, std::int32_t to) const;

  /// `to` takes over the quadrics of `from`.
  void merge(std::int32_t from, std::int32_t to);

 private:
  static constexpr int kCoefficients = 10;  ///< of x^T A x + 2 b^T x + c: xx, xy, xz, yy, yz, zz, x, y, z, 1

  void addPlane(Eigen::Index shape, std::int32_t v, const Eigen::RowVector3d& normal, const Eigen::RowVector3d& point,
                double weight);
  void addPoint(Eigen::Index shape, std::int32_t v, const Eigen::RowVector3d& point, double weight);
  auto coefficients(std::int32_t v) const { return quadrics_.middleCols<kCoefficients>(kCoefficients * v); }

  Eigen::ArrayXXd quadrics_;  ///< n x 10V
};

}  // namespace shaped
