#include "tests/fuzz/mesh_round_trip.h"

#include "core/io/mesh_file.h"
#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {
namespace {

void requireMesh(const MeshFile& mesh) {
  require(mesh.vertices.rows() > 0 && mesh.faces.rows() > 0, "a mesh has vertices and faces");
  require(mesh.vertices.allFinite(), "vertices are finite");
  require(mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.vertices.rows(), "corners are vertices");
}

/// Positions of all corners, rounded to floats: what an STL file keeps.
Eigen::MatrixXf cornersOf(const MeshFile& mesh) {
  Eigen::MatrixXf corners(mesh.faces.size(), 3);
  for (Eigen::Index i = 0; i < corners.rows(); ++i)
    corners.row(i) = mesh.vertices.row(mesh.faces(i / 3, i % 3)).cast<float>();
  return corners;
}

}  // namespace

void readAndRewriteMesh(std::string_view bytes, std::string_view extension) {
  const auto file = scratchFile("mesh" + std::string(extension), bytes);
  const auto mesh = accepted<InvalidInput>([&] { return readMesh(file); });
  if (!mesh) return;
  requireMesh(*mesh);
  if (extension == ".stl") {
    // a coordinate beyond floats is refused, as documented
    if (!accepted<InvalidInput>([&] { return writeMesh(file, mesh->vertices, mesh->faces), true; })) return;
    const auto back = readMesh(file);
    requireMesh(back);
    require(cornersOf(back) == cornersOf(*mesh), "corners survive");
    return;
  }
  writeMesh(file, mesh->vertices, mesh->faces);
  const auto back = readMesh(file);
  require(back.vertices == mesh->vertices, "vertices survive");
  require(back.faces == mesh->faces, "faces survive");
}

}  // namespace shaped::fuzz
