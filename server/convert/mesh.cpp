#include "server/convert/mesh.h"

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

// A topology's errors start with the part that is wrong ("faces[3]"); the request's field goes in front.
[[noreturn]] void rethrowUnder(const std::string& field, const InvalidInput& error) {
  throw InvalidInput(field, error.what());
}

}  // namespace

Vertices pointsFromProto(const PackedPositions& packed, Eigen::Index count, const std::string& field) {
  if (packed.size() != 3 * count)
    throw InvalidInput(field, "has " + std::to_string(packed.size()) + " numbers, want " + std::to_string(3 * count) +
                                  " (three each of " + std::to_string(count) + " points)");
  using PackedMatrix = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const PackedMatrix>(packed.data(), count, 3).cast<double>();
}

Faces facesFromProto(const PackedFaces& packed, std::int64_t vertex_count, const Limits& limits,
                     const std::string& field) {
  if (packed.empty() || packed.size() % 3 != 0)
    throw InvalidInput(field, "has " + std::to_string(packed.size()) + " indices, want three for each face");
  if (vertex_count < 3)
    throw InvalidInput(field, "refers to " + std::to_string(vertex_count) + " vertices; a mesh needs at least three");
  requireAtMost(vertex_count, limits.vertices, field, "vertices to refer to");
  requireAtMost(packed.size() / 3, limits.faces, field, "faces");
  for (int i = 0; i < packed.size(); ++i)
    if (packed[i] >= static_cast<std::uint64_t>(vertex_count))
      throw InvalidInput(
          field + "[" + std::to_string(i / 3) + "]",
          "vertex index " + std::to_string(packed[i]) + " is outside [0, " + std::to_string(vertex_count) + ")");
  using PackedMatrix = Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const PackedMatrix>(packed.data(), packed.size() / 3, 3).cast<std::int32_t>();
}

Vertices shapeFromProto(const v1::Shape& shape, const Topology& topology, const std::string& field) {
  if (shape.positions_size() % 3 == 0 && shape.positions_size() / 3 != topology.vertexCount())
    throw InvalidInput(field, "has " + std::to_string(shape.positions_size() / 3) + " vertices, want " +
                                  std::to_string(topology.vertexCount()));
  if (!shape.topology_id().empty() && shape.topology_id() != topology.id())
    throw InvalidInput(field + ".topology_id",
                       "is " + shape.topology_id().substr(0, 64) + ", want " + topology.id() +
                           ": the mesh is connected differently, register it to this one first");
  auto vertices = pointsFromProto(shape.positions(), topology.vertexCount(), field + ".positions");
  requireValidShape(topology, vertices, field);
  return vertices;
}

OwnedMesh meshFromProto(const v1::Mesh& mesh, const Limits& limits, const std::string& field) {
  const std::int64_t vertex_count = mesh.positions_size() / 3;
  auto vertices = pointsFromProto(mesh.positions(), vertex_count, field + ".positions");
  auto faces = facesFromProto(mesh.faces(), vertex_count, limits, field + ".faces");
  try {
    auto topology = std::make_shared<const Topology>(static_cast<std::int32_t>(vertex_count), std::move(faces));
    requireOneComponent(*topology, "faces");
    requireValidShape(*topology, vertices, "vertices");
    return {std::move(topology), std::move(vertices)};
  } catch (const InvalidInput& error) {
    rethrowUnder(field, error);
  }
}

void toProto(const Vertices& vertices, PackedPositions& packed) {
  packed.Resize(static_cast<int>(vertices.size()), 0);
  using PackedMatrix = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Eigen::Map<PackedMatrix>(packed.mutable_data(), vertices.rows(), 3) = vertices.cast<float>();
}

void toProto(const Vertices& vertices, const Topology& topology, v1::Shape& shape) {
  toProto(vertices, *shape.mutable_positions());
  shape.set_topology_id(topology.id());
}

void toProto(const Vertices& vertices, const Topology& topology, v1::Mesh& mesh) {
  toProto(vertices, *mesh.mutable_positions());
  const auto& faces = topology.faces();
  mesh.mutable_faces()->Resize(static_cast<int>(faces.size()), 0);
  using PackedMatrix = Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Eigen::Map<PackedMatrix>(mesh.mutable_faces()->mutable_data(), faces.rows(), 3) = faces.cast<std::uint32_t>();
}

}  // namespace shaped::server
