#include "core/mesh/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "core/numerics/error.h"

namespace shaped {
namespace {

std::string facePath(Eigen::Index face) { return "faces[" + std::to_string(face) + "]"; }
std::string vertexPath(Eigen::Index vertex) { return "vertices[" + std::to_string(vertex) + "]"; }

/// One side of an edge: the face and the corner opposite the edge.
struct HalfEdge {
  std::int32_t from, to, face, corner;
};

void checkFaceIndices(std::int32_t vertex_count, const Faces& faces) {
  if (vertex_count < 3 || faces.rows() < 1) throw InvalidInput("faces", "a mesh needs at least three vertices and one face");
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      if (faces(f, c) < 0 || faces(f, c) >= vertex_count)
        throw InvalidInput(facePath(f), "vertex index " + std::to_string(faces(f, c)) + " is outside [0, " +
                                            std::to_string(vertex_count) + ")");
      if (faces(f, c) == faces(f, (c + 1) % 3))
        throw InvalidInput(facePath(f), "repeats vertex " + std::to_string(faces(f, c)) + "; remove degenerate faces");
    }
  }
}

/// All half-edges, sorted so that the two sides of an edge are neighbours.
std::vector<HalfEdge> sortedHalfEdges(const Faces& faces) {
  std::vector<HalfEdge> sides;
  sides.reserve(static_cast<std::size_t>(faces.rows()) * 3);
  for (std::int32_t f = 0; f < faces.rows(); ++f)
    for (std::int32_t c = 0; c < 3; ++c) sides.push_back({faces(f, (c + 1) % 3), faces(f, (c + 2) % 3), f, c});
  std::sort(sides.begin(), sides.end(), [](const HalfEdge& a, const HalfEdge& b) {
    const auto key = [](const HalfEdge& h) {
      return std::array{std::min(h.from, h.to), std::max(h.from, h.to), h.face, h.corner};
    };
    return key(a) < key(b);
  });
  return sides;
}

std::int32_t findRoot(std::vector<std::int32_t>& parent, std::int32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

Topology::Topology(std::int32_t vertex_count, Faces faces) : vertex_count_(vertex_count), faces_(std::move(faces)) {
  checkFaceIndices(vertex_count_, faces_);
  buildEdges();
  checkVertexFans();
  labelComponents();
  hashFaces();
}

void Topology::buildEdges() {
  const auto sides = sortedHalfEdges(faces_);
  face_edges_.resize(static_cast<std::size_t>(faces_.rows()));
  std::vector<std::array<HalfEdge, 2>> interior;
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    const auto low = std::min(sides[begin].from, sides[begin].to), high = std::max(sides[begin].from, sides[begin].to);
    while (end < sides.size() && std::min(sides[end].from, sides[end].to) == low &&
           std::max(sides[end].from, sides[end].to) == high)
      face_edges_[sides[end].face][sides[end].corner] = static_cast<std::int32_t>(edges_.size()), ++end;
    const std::string edge = "edge (" + std::to_string(low) + ", " + std::to_string(high) + ")";
    if (end - begin > 2)
      throw InvalidInput("faces", edge + " has " + std::to_string(end - begin) + " faces; a surface has at most two");
    if (end - begin == 2 && sides[begin].from == sides[begin + 1].from)
      throw InvalidInput(facePath(sides[begin + 1].face), edge + " runs the same way as in face " +
                                                              std::to_string(sides[begin].face) +
                                                              "; orient all faces alike");
    edges_.push_back({low, high});
    if (end - begin == 2) interior.push_back({sides[begin], sides[begin + 1]});
  }
  hinges_.reserve(interior.size());
  face_hinges_.assign(face_edges_.size(), {-1, -1, -1});
  for (const auto& [one, two] : interior) {
    face_hinges_[one.face][one.corner] = face_hinges_[two.face][two.corner] = static_cast<std::int32_t>(hinges_.size());
    const auto& e1 = face_edges_[one.face];
    const auto& e2 = face_edges_[two.face];
    hinges_.push_back({{one.from, one.to, faces_(one.face, one.corner), faces_(two.face, two.corner)},
                       {e1[one.corner], e1[(one.corner + 1) % 3], e1[(one.corner + 2) % 3], e2[(two.corner + 1) % 3],
                        e2[(two.corner + 2) % 3]},
                       {one.face, two.face}});
  }
}

void Topology::checkVertexFans() const {
  // Of more vertices than corners, one of the first is unused: a count far beyond the faces costs no memory.
  std::vector<char> used(static_cast<std::size_t>(std::min<Eigen::Index>(vertex_count_, faces_.size() + 1)), 0);
  for (const auto vertex : faces_.reshaped())
    if (static_cast<std::size_t>(vertex) < used.size()) used[vertex] = 1;
  if (const auto unused = std::find(used.begin(), used.end(), 0); unused != used.end())
    throw InvalidInput(vertexPath(unused - used.begin()), "belongs to no face; remove unused vertices");
  // The corners at a vertex hang together through the edges there. As an edge has at most two faces, a group of them is a
  // fan, open or closed, and the vertex must have one group.
  std::vector<std::int32_t> parent(static_cast<std::size_t>(faces_.size()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto cornerOf = [&](std::int32_t face, std::int32_t vertex) {
    const int corner = faces_(face, 0) == vertex ? 0 : faces_(face, 1) == vertex ? 1 : 2;
    return findRoot(parent, 3 * face + corner);
  };
  for (const auto& hinge : hinges_)
    for (const auto vertex : {hinge.vertices[0], hinge.vertices[1]})
      parent[cornerOf(hinge.faces[0], vertex)] = cornerOf(hinge.faces[1], vertex);
  std::vector<std::int32_t> group(vertex_count_, -1);
  for (std::int32_t corner = 0; corner < faces_.size(); ++corner) {
    const auto vertex = faces_(corner / 3, corner % 3), root = findRoot(parent, corner);
    if (group[vertex] >= 0 && group[vertex] != root)
      throw InvalidInput(vertexPath(vertex), "joins several sheets in one point; split it");
    group[vertex] = root;
  }
}

void Topology::labelComponents() {
  std::vector<std::int32_t> parent(vertex_count_);
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& [a, b] : edges_) {
    const auto ra = findRoot(parent, a), rb = findRoot(parent, b);
    parent[std::max(ra, rb)] = std::min(ra, rb);
  }
  components_.assign(vertex_count_, -1);
  for (std::int32_t v = 0; v < vertex_count_; ++v) {
    const auto root = findRoot(parent, v);
    components_[v] = root == v ? component_count_++ : components_[root];
  }
}

void Topology::hashFaces() {
  constexpr std::uint64_t prime = 1099511628211ULL;  // FNV-1a, two streams
  std::uint64_t one = 14695981039346656037ULL, two = 0x9e3779b97f4a7c15ULL;
  const auto mix = [&](std::uint32_t value) {
    for (int byte = 0; byte < 4; ++byte, value >>= 8) {
      one = (one ^ (value & 255)) * prime;
      two = (two ^ ((value & 255) + 0x51)) * prime;
      two ^= two >> 29;
    }
  };
  mix(static_cast<std::uint32_t>(vertex_count_));
  for (Eigen::Index f = 0; f < faces_.rows(); ++f)
    for (int c = 0; c < 3; ++c) mix(static_cast<std::uint32_t>(faces_(f, c)));
  constexpr char digits[] = "0123456789abcdef";
  for (const auto word : {one, two})
    for (int shift = 60; shift >= 0; shift -= 4) id_.push_back(digits[(word >> shift) & 15]);
}

void requireOneComponent(const Topology& topology, const std::string& field) {
  if (topology.componentCount() != 1)
    throw InvalidInput(field, "has " + std::to_string(topology.componentCount()) +
                                  " connected components; a shell model needs one, so keep the largest or join them");
}

void requireValidShape(const Topology& topology, const Vertices& shape, const std::string& field) {
  if (shape.rows() != topology.vertexCount())
    throw InvalidInput(field, "has " + std::to_string(shape.rows()) + " vertices, want " +
                                  std::to_string(topology.vertexCount()));
  for (Eigen::Index v = 0; v < shape.rows(); ++v)
    if (!shape.row(v).allFinite())
      throw InvalidInput(field, "vertex " + std::to_string(v) + " has a coordinate that is not a finite number");
  const auto& faces = topology.faces();
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d a = shape.row(faces(f, 1)) - shape.row(faces(f, 0));
    const Eigen::RowVector3d b = shape.row(faces(f, 2)) - shape.row(faces(f, 0));
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    if (!(0.5 * a.cross(b).norm() > 1e-12 * longest))
      throw InvalidInput(field, "face " + std::to_string(f) + " is degenerate (no area); repair the mesh");
  }
}

}  // namespace shaped
