#pragma once

#include <memory>
#include <span>

#include "core/mesh/types.h"

namespace shaped {

/// A point of a set and the square of its distance to the query.
struct NearPoint {
  std::int32_t index;
  double squared_distance;
};

/// Nearest neighbours in one set of points: a k-d tree built once, then many queries. A query is const and may run from
/// several threads at once.
class PointTree {
 public:
  /// points: N x 3, N >= 1, finite. Copied.
  explicit PointTree(const Vertices& points);
  ~PointTree();
  PointTree(PointTree&&) noexcept;
  PointTree& operator=(PointTree&&) noexcept;

  const Vertices& points() const;
  NearPoint nearest(const Eigen::RowVector3d& query) const;
  /// The found.size() nearest points, nearest first; returns how many there are (fewer in a smaller set).
  std::size_t nearest(const Eigen::RowVector3d& query, std::span<NearPoint> found) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace shaped
