#include "core/surface/point_tree.h"

#include <nanoflann.hpp>
#include <vector>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// The rows of a matrix as nanoflann wants to read them.
struct Rows {
  Vertices points;

  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.rows()); }
  double kdtree_get_pt(std::size_t row, std::size_t axis) const {
    return points(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Rows>, Rows, 3, std::int32_t>;

Rows requirePoints(const Vertices& points) {
  if (points.rows() == 0) throw InvalidInput("points", "are none; nearest neighbours need at least one");
  if (!points.allFinite()) throw InvalidInput("points", "hold a coordinate that is not a finite number");
  return {points};
}

}  // namespace

struct PointTree::Tree {
  Rows rows;
  KdTree tree;

  explicit Tree(const Vertices& points)
      : rows(requirePoints(points)), tree(3, rows, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    tree.buildIndex();
  }
};

PointTree::PointTree(const Vertices& points) : tree_(std::make_unique<Tree>(points)) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

const Vertices& PointTree::points() const { return tree_->rows.points; }

NearPoint PointTree::nearest(const Eigen::RowVector3d& query) const {
  NearPoint found{};
  tree_->tree.knnSearch(query.data(), 1, &found.index, &found.squared_distance);
  return found;
}

std::size_t PointTree::nearest(const Eigen::RowVector3d& query, std::span<NearPoint> found) const {
  std::vector<std::int32_t> indices(found.size());
  std::vector<double> distances(found.size());
  const auto count =
      tree_->tree.knnSearch(query.data(), static_cast<std::int32_t>(found.size()), indices.data(), distances.data());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) found[i] = {indices[i], distances[i]};
  return static_cast<std::size_t>(count);
}

}  // namespace shaped
