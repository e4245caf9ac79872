#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/io/mesh_file.h"
#include "core/mesh/scan.h"

namespace shaped {

enum class FileNormals { kSkipped, kKept };

/// Collects what a parser of meshes or scans meets, in order, and checks it: finite coordinates, at least three corners
/// a polygon, and, at the end, that every corner is a vertex and that what is wanted is there. Errors name the file.
class PolygonSoup {
 public:
  explicit PolygonSoup(std::string file, FileNormals normals = FileNormals::kSkipped)
      : file_(std::move(file)), keeps_normals_(normals == FileNormals::kKept) {}

  /// Whether parsers are to call addNormal.
  bool keepsNormals() const { return keeps_normals_; }
  void addVertex(double x, double y, double z);
  /// The normal of the first vertex that has none yet; any length but 0.
  void addNormal(double x, double y, double z);
  /// corners: vertex indices from 0; vertices may follow later. Fans out from the first corner.
  void addPolygon(std::span<const std::int64_t> corners);
  std::int64_t vertexCount() const { return static_cast<std::int64_t>(coordinates_.size() / 3); }
  /// The mesh: vertices and faces must be there. The soup is empty afterwards.
  MeshFile finishMesh();
  /// The scan: points must be there, and either no normals or one for each. The soup is empty afterwards.
  Scan finishScan();

 private:
  void requireCorners() const;
  Vertices vertices() const;
  Faces faces() const;

  std::string file_;
  bool keeps_normals_;
  std::vector<double> coordinates_, normals_;
  std::vector<std::int32_t> triangles_;
  std::int64_t polygon_count_ = 0;
  std::int64_t largest_corner_ = -1, polygon_of_largest_ = -1;
};

}  // namespace shaped
