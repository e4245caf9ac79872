#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// An interior edge with its two triangles, the stencil of the bending energy.
///
/// Edge v0 -> v1 runs as in the first triangle (v0, v1, v2); the second triangle is (v1, v0, v3).
struct Hinge {
  std::array<std::int32_t, 4> vertices;  ///< v0, v1, v2, v3
  std::array<std::int32_t, 5> edges;     ///< v0v1, v1v2, v2v0, v0v3, v3v1
  std::array<std::int32_t, 2> faces;     ///< of v2, of v3
};

/// The connectivity that all shapes of a model share: triangles, edges and hinges of an oriented 2-manifold with or
/// without boundary. Immutable; held by shared pointer.
class Topology {
 public:
  /// faces: indices in [0, vertex_count). Throws InvalidInput, naming the face or vertex, when an index is out of range,
  /// a face repeats a vertex, an edge has more than two faces or two that disagree in orientation, a vertex belongs to
  /// no face, or the faces around a vertex do not form one fan.
  Topology(std::int32_t vertex_count, Faces faces);

  std::int32_t vertexCount() const { return vertex_count_; }
  const Faces& faces() const { return faces_; }
  /// E x 2, each with the smaller index first.
  const std::vector<std::array<std::int32_t, 2>>& edges() const { return edges_; }
  /// F x 3: entry i is the edge opposite the face's corner i.
  const std::vector<std::array<std::int32_t, 3>>& faceEdges() const { return face_edges_; }
  /// One per interior edge.
  const std::vector<Hinge>& hinges() const { return hinges_; }
  /// F x 3: entry i is the hinge at the edge opposite the face's corner i, -1 at the boundary.
  const std::vector<std::array<std::int32_t, 3>>& faceHinges() const { return face_hinges_; }
  /// Component of each vertex, numbered from 0 in order of the smallest vertex.
  const std::vector<std::int32_t>& components() const { return components_; }
  std::int32_t componentCount() const { return component_count_; }
  bool closed() const { return hinges_.size() == edges_.size(); }
  /// 32 hexadecimal digits, a hash of vertex count and faces.
  const std::string& id() const { return id_; }

 private:
  void buildEdges();
  void checkVertexFans() const;
  void labelComponents();
  void hashFaces();

  std::int32_t vertex_count_;
  Faces faces_;
  std::vector<std::array<std::int32_t, 2>> edges_;
  std::vector<std::array<std::int32_t, 3>> face_edges_, face_hinges_;
  std::vector<Hinge> hinges_;
  std::vector<std::int32_t> components_;
  std::int32_t component_count_ = 0;
  std::string id_;
};

using TopologyPtr = std::shared_ptr<const Topology>;

/// Throws InvalidInput naming `field` unless the topology is in one piece: the shell gauge removes one rigid motion.
void requireOneComponent(const Topology& topology, const std::string& field);

/// Throws InvalidInput naming `field` and the vertex or face when the shape has the wrong number of vertices, a position
/// that is not finite, or a triangle without area (below 1e-12 of its longest edge squared).
void requireValidShape(const Topology& topology, const Vertices& shape, const std::string& field);

}  // namespace shaped
