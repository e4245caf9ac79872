#pragma once

#include <string>

#include "core/mesh/topology.h"
#include "core/mesh/types.h"
#include "server/convert/limits.h"
#include "shaped/v1/mesh.pb.h"

namespace shaped::server {

using PackedPositions = google::protobuf::RepeatedField<float>;
using PackedFaces = google::protobuf::RepeatedField<std::uint32_t>;

/// N x 3 positions from 3 N floats. Throws InvalidInput naming `field` and the count when that is not what is there.
/// Whether the numbers are finite is not checked: NaN is a missing marker.
Vertices pointsFromProto(const PackedPositions& packed, Eigen::Index count, const std::string& field);

/// F x 3 indices. Throws InvalidInput naming `field` when the count is no multiple of three, zero, or an index is not
/// in [0, vertex_count), or when there are more faces or vertices than the limits allow.
Faces facesFromProto(const PackedFaces& packed, std::int64_t vertex_count, const Limits& limits,
                     const std::string& field);

/// The positions of a shape that must fit a topology: vertex count, topology id if given, finite, no triangle without
/// area. Throws InvalidInput naming `field` and the vertex or face.
Vertices shapeFromProto(const v1::Shape& shape, const Topology& topology, const std::string& field);

/// A mesh that brings its own connectivity.
struct OwnedMesh {
  TopologyPtr topology;
  Vertices vertices;
};

/// Throws InvalidInput naming `field` when the faces are no one-component two-manifold, a position is faulty, or the
/// mesh is larger than the limits allow.
OwnedMesh meshFromProto(const v1::Mesh& mesh, const Limits& limits, const std::string& field);

/// Rounds to float.
void toProto(const Vertices& vertices, PackedPositions& packed);
void toProto(const Vertices& vertices, const Topology& topology, v1::Shape& shape);
void toProto(const Vertices& vertices, const Topology& topology, v1::Mesh& mesh);

}  // namespace shaped::server
