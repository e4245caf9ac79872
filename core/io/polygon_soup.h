#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/io/mesh_file.h"

namespace shaped {

/// Collects what a mesh parser meets, in order, and checks it: finite coordinates, at least three corners a polygon,
/// and, at the end, that every corner is a vertex and that there are vertices and faces. Errors name the file.
class PolygonSoup {
 public:
  explicit PolygonSoup(std::string file) : file_(std::move(file)) {}

  void addVertex(double x, double y, double z);
  /// corners: vertex indices from 0; vertices may follow later. Fans out from the first corner.
  void addPolygon(std::span<const std::int64_t> corners);
  std::int64_t vertexCount() const { return static_cast<std::int64_t>(coordinates_.size() / 3); }
  /// The mesh; the soup is empty afterwards.
  MeshFile finish();

 private:
  std::string file_;
  std::vector<double> coordinates_;
  std::vector<std::int32_t> triangles_;
  std::int64_t polygon_count_ = 0;
  std::int64_t largest_corner_ = -1, polygon_of_largest_ = -1;
};

}  // namespace shaped
