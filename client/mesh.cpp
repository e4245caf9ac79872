#include "client/mesh.h"

#include "core/numerics/error.h"

namespace shaped::client {
namespace {

template <class Number>
using Packed = Eigen::Matrix<Number, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace

void pack(const Vertices& vertices, google::protobuf::RepeatedField<float>& positions) {
  positions.Resize(static_cast<int>(vertices.size()), 0);
  Eigen::Map<Packed<float>>(positions.mutable_data(), vertices.rows(), 3) = vertices.cast<float>();
}

void pack(const Faces& faces, google::protobuf::RepeatedField<std::uint32_t>& packed) {
  packed.Resize(static_cast<int>(faces.size()), 0);
  Eigen::Map<Packed<std::uint32_t>>(packed.mutable_data(), faces.rows(), 3) = faces.cast<std::uint32_t>();
}

v1::Mesh pack(const MeshFile& mesh) {
  v1::Mesh packed;
  pack(mesh.vertices, *packed.mutable_positions());
  pack(mesh.faces, *packed.mutable_faces());
  return packed;
}

Vertices unpack(const google::protobuf::RepeatedField<float>& positions) {
  return Eigen::Map<const Packed<float>>(positions.data(), positions.size() / 3, 3).cast<double>();
}

Faces unpack(const google::protobuf::RepeatedField<std::uint32_t>& faces) {
  return Eigen::Map<const Packed<std::uint32_t>>(faces.data(), faces.size() / 3, 3).cast<std::int32_t>();
}

v1::Shape readShape(const std::filesystem::path& path, Eigen::Index vertex_count, const Faces& faces) {
  const auto mesh = readMesh(path);
  requireConnectivity(path.string(), mesh, vertex_count, faces, "the model");
  v1::Shape shape;
  pack(mesh.vertices, *shape.mutable_positions());
  return shape;
}

void requireConnectivity(const std::string& file, const MeshFile& mesh, Eigen::Index vertex_count, const Faces& faces,
                         const std::string& reference) {
  const auto differs = [&](const std::string& how) {
    throw InvalidInput(file, how + "; all shapes of a model share one connectivity, register this one to it first");
  };
  if (mesh.vertices.rows() != vertex_count)
    differs("has " + std::to_string(mesh.vertices.rows()) + " vertices, " + reference + " has " +
            std::to_string(vertex_count));
  if (mesh.faces.rows() != faces.rows())
    differs("has " + std::to_string(mesh.faces.rows()) + " faces, " + reference + " has " +
            std::to_string(faces.rows()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    if (mesh.faces.row(f) != faces.row(f))
      differs("is connected differently from " + reference + " at face " + std::to_string(f));
}

}  // namespace shaped::client
