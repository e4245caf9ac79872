#include "core/sample/marching_tetrahedra.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace shaped {
namespace {

/// Function values on the corners of a box of cubes.
struct Grid {
  Eigen::Vector3d low;
  double spacing;
  std::array<int, 3> corners;  ///< along x, y, z
  std::vector<double> values;

  std::int64_t index(int i, int j, int k) const { return (std::int64_t{k} * corners[1] + j) * corners[0] + i; }
  Eigen::Vector3d position(std::int64_t index) const {
    const auto i = index % corners[0], j = index / corners[0] % corners[1], k = index / corners[0] / corners[1];
    return low + spacing * Eigen::Vector3d(double(i), double(j), double(k));
  }
};

Grid sampleGrid(const std::function<double(const Eigen::Vector3d&)>& value, const Eigen::Vector3d& low,
                const Eigen::Vector3d& high, double spacing) {
  Grid grid{low, spacing, {}, {}};
  for (int axis = 0; axis < 3; ++axis)
    grid.corners[axis] = 2 + static_cast<int>(std::ceil((high[axis] - low[axis]) / spacing));
  const auto count = grid.index(0, 0, grid.corners[2]);
  grid.values.reserve(static_cast<std::size_t>(count));
  for (std::int64_t c = 0; c < count; ++c) grid.values.push_back(value(grid.position(c)));
  return grid;
}

/// Collects the triangles of all tetrahedra; a vertex on a grid edge is shared by all that meet there.
class Marcher {
 public:
  explicit Marcher(const Grid& grid) : grid_(grid) {}

  void march(const std::array<std::int64_t, 4>& tetrahedron) {
    std::vector<std::int64_t> inside, outside;
    for (const auto corner : tetrahedron) (value(corner) < 0 ? inside : outside).push_back(corner);
    if (inside.empty() || outside.empty()) return;
    const Eigen::Vector3d outward = mean(outside) - mean(inside);
    if (inside.size() == 1)
      addTriangle(vertex(inside[0], outside[0]), vertex(inside[0], outside[1]), vertex(inside[0], outside[2]), outward);
    else if (outside.size() == 1)
      addTriangle(vertex(inside[0], outside[0]), vertex(inside[1], outside[0]), vertex(inside[2], outside[0]), outward);
    else
      addQuad(vertex(inside[0], outside[0]), vertex(inside[0], outside[1]), vertex(inside[1], outside[1]),
              vertex(inside[1], outside[0]), outward);
  }

  SurfaceMesh mesh() const {
    SurfaceMesh result{Vertices(static_cast<Eigen::Index>(positions_.size()), 3),
                       Faces(static_cast<Eigen::Index>(triangles_.size()), 3)};
    for (std::size_t v = 0; v < positions_.size(); ++v)
      result.vertices.row(Eigen::Index(v)) = positions_[v].transpose();
    for (std::size_t f = 0; f < triangles_.size(); ++f)
      result.faces.row(Eigen::Index(f)) << triangles_[f][0], triangles_[f][1], triangles_[f][2];
    return result;
  }

 private:
  double value(std::int64_t corner) const { return grid_.values[static_cast<std::size_t>(corner)]; }

  Eigen::Vector3d mean(const std::vector<std::int64_t>& corners) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto corner : corners) sum += grid_.position(corner);
    return sum / static_cast<double>(corners.size());
  }

  std::int32_t vertex(std::int64_t inside, std::int64_t outside) {
    const auto low = std::min(inside, outside), high = std::max(inside, outside);
    const auto [found, fresh] =
        vertex_of_edge_.try_emplace(low * std::int64_t(grid_.values.size()) + high, std::int32_t(positions_.size()));
    if (fresh) {
      // Kept off the grid's corners, where several vertices would meet in one point.
      const double t = std::clamp(value(inside) / (value(inside) - value(outside)), 0.03, 0.97);
      positions_.push_back((1 - t) * grid_.position(inside) + t * grid_.position(outside));
    }
    return found->second;
  }

  void addTriangle(std::int32_t a, std::int32_t b, std::int32_t c, const Eigen::Vector3d& outward) {
    const Eigen::Vector3d normal = (positions_[b] - positions_[a]).cross(positions_[c] - positions_[a]);
    if (normal.dot(outward) > 0)
      triangles_.push_back({a, b, c});
    else
      triangles_.push_back({a, c, b});
  }

  void addQuad(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d, const Eigen::Vector3d& outward) {
    addTriangle(a, b, c, outward);
    addTriangle(a, c, d, outward);
  }

  const Grid& grid_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::unordered_map<std::int64_t, std::int32_t> vertex_of_edge_;
};

}  // namespace

SurfaceMesh marchTetrahedra(const std::function<double(const Eigen::Vector3d&)>& value, const Eigen::Vector3d& low,
                            const Eigen::Vector3d& high, double spacing) {
  const Grid grid = sampleGrid(value, low, high, spacing);
  Marcher marcher(grid);
  // Kuhn's six tetrahedra: every way to walk from a cube's corner to the opposite one along three edges.
  constexpr int walks[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int k = 0; k + 1 < grid.corners[2]; ++k)
    for (int j = 0; j + 1 < grid.corners[1]; ++j)
      for (int i = 0; i + 1 < grid.corners[0]; ++i)
        for (const auto& walk : walks) {
          std::array<int, 3> corner{i, j, k};
          std::array<std::int64_t, 4> tetrahedron{grid.index(i, j, k)};
          for (int step = 0; step < 3; ++step) {
            ++corner[static_cast<std::size_t>(walk[step])];
            tetrahedron[static_cast<std::size_t>(step) + 1] = grid.index(corner[0], corner[1], corner[2]);
          }
          marcher.march(tetrahedron);
        }
  return marcher.mesh();
}

}  // namespace shaped
