#include "core/io/polygon_soup.h"

#include <cmath>
#include <limits>

#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::int64_t kMostVertices = std::numeric_limits<std::int32_t>::max();

std::string badCorner(std::int64_t polygon, std::int64_t corner, std::int64_t vertex_count) {
  return "face " + std::to_string(polygon) + " has vertex index " + std::to_string(corner) +
         " (counted from 0), outside the file's " + std::to_string(vertex_count) + " vertices";
}

}  // namespace

void PolygonSoup::addVertex(double x, double y, double z) {
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
    throw InvalidInput(file_,
                       "vertex " + std::to_string(vertexCount()) + " has a coordinate that is not a finite number");
  if (vertexCount() == kMostVertices) throw InvalidInput(file_, "has more than 2147483647 vertices");
  coordinates_.insert(coordinates_.end(), {x, y, z});
}

void PolygonSoup::addPolygon(std::span<const std::int64_t> corners) {
  if (corners.size() < 3)
    throw InvalidInput(file_, "face " + std::to_string(polygon_count_) + " has " + std::to_string(corners.size()) +
                                  " corners; want at least 3");
  for (const auto corner : corners) {
    if (corner < 0 || corner >= kMostVertices)
      throw InvalidInput(file_, badCorner(polygon_count_, corner, vertexCount()));
    if (corner > largest_corner_) largest_corner_ = corner, polygon_of_largest_ = polygon_count_;
  }
  for (std::size_t c = 2; c < corners.size(); ++c)
    for (const auto corner : {corners[0], corners[c - 1], corners[c]})
      triangles_.push_back(static_cast<std::int32_t>(corner));
  ++polygon_count_;
}

void PolygonSoup::addNormal(double x, double y, double z) {
  const auto refuse = [&](const char* problem) {
    throw InvalidInput(file_, "vertex " + std::to_string(normals_.size() / 3) + " has a normal " + problem);
  };
  Eigen::Vector3d normal(x, y, z);
  if (!normal.allFinite()) refuse("that is not finite");
  const double largest = normal.cwiseAbs().maxCoeff();
  if (largest == 0) refuse("of length zero");
  // What is of unit length to rounding stays as it is, so that files read back exactly.
  if (!(std::abs(normal.squaredNorm() - 1) < 1e-14)) normal = (normal / largest).normalized();
  normals_.insert(normals_.end(), normal.begin(), normal.end());
}

MeshFile PolygonSoup::finishMesh() {
  if (coordinates_.empty()) throw InvalidInput(file_, "has no vertices");
  if (triangles_.empty()) throw InvalidInput(file_, "has no faces; a mesh is needed, not a point cloud");
  requireCorners();
  MeshFile mesh{vertices(), faces()};
  *this = PolygonSoup(file_);
  return mesh;
}

Scan PolygonSoup::finishScan() {
  if (coordinates_.empty()) throw InvalidInput(file_, "has no points");
  if (!normals_.empty() && normals_.size() != coordinates_.size())
    throw InvalidInput(file_, "has " + std::to_string(normals_.size() / 3) + " normals for " +
                                  std::to_string(vertexCount()) + " points");
  requireCorners();
  Scan scan{vertices(), Eigen::Map<const Vertices>(normals_.data(), static_cast<Eigen::Index>(normals_.size() / 3), 3),
            faces()};
  *this = PolygonSoup(file_, FileNormals::kKept);
  return scan;
}

void PolygonSoup::requireCorners() const {
  if (largest_corner_ >= vertexCount())
    throw InvalidInput(file_, badCorner(polygon_of_largest_, largest_corner_, vertexCount()));
}

Vertices PolygonSoup::vertices() const { return Eigen::Map<const Vertices>(coordinates_.data(), vertexCount(), 3); }

Faces PolygonSoup::faces() const {
  return Eigen::Map<const Faces>(triangles_.data(), static_cast<Eigen::Index>(triangles_.size() / 3), 3);
}

}  // namespace shaped
