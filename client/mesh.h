#pragma once

#include <filesystem>

#include "core/io/mesh_file.h"
#include "core/mesh/types.h"
#include "shaped/v1/mesh.pb.h"

namespace shaped::client {

/// Positions and faces as they travel; positions are rounded to float.
void pack(const Vertices& vertices, google::protobuf::RepeatedField<float>& positions);
void pack(const Faces& faces, google::protobuf::RepeatedField<std::uint32_t>& packed);
v1::Mesh pack(const MeshFile& mesh);

/// The positions of an answer, V x 3 [m].
Vertices unpack(const google::protobuf::RepeatedField<float>& positions);
Faces unpack(const google::protobuf::RepeatedField<std::uint32_t>& faces);

/// A mesh file as a shape of the model with these faces. Throws InvalidInput naming the file when it has another
/// connectivity, or as readMesh does.
v1::Shape readShape(const std::filesystem::path& path, Eigen::Index vertex_count, const Faces& faces);

/// Throws InvalidInput naming `file` unless the mesh has this vertex count and these faces, `reference` being what has
/// them.
void requireConnectivity(const std::string& file, const MeshFile& mesh, Eigen::Index vertex_count, const Faces& faces,
                         const std::string& reference);

}  // namespace shaped::client
