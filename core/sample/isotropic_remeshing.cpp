#include "core/sample/isotropic_remeshing.h"

#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <cmath>
#include <vector>

namespace shaped {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status);
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;
using OpenMesh::EdgeHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

using Position = Eigen::Map<const Eigen::Vector3d>;  // OpenMesh's own vectors lack what is needed here

OpenMesh::Vec3d toPoint(const Eigen::Vector3d& position) { return {position.x(), position.y(), position.z()}; }

HalfEdgeMesh toHalfEdges(const SurfaceMesh& mesh) {
  HalfEdgeMesh result;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) result.add_vertex(toPoint(mesh.vertices.row(v).transpose()));
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    result.add_face(VertexHandle(mesh.faces(f, 0)), VertexHandle(mesh.faces(f, 1)), VertexHandle(mesh.faces(f, 2)));
  return result;
}

SurfaceMesh fromHalfEdges(HalfEdgeMesh& mesh) {
  mesh.garbage_collection();
  SurfaceMesh result{Vertices(Eigen::Index(mesh.n_vertices()), 3), Faces(Eigen::Index(mesh.n_faces()), 3)};
  for (const auto v : mesh.vertices()) result.vertices.row(v.idx()) = Position(mesh.point(v).data()).transpose();
  for (const auto f : mesh.faces()) {
    int corner = 0;
    for (const auto v : mesh.fv_range(f)) result.faces(f.idx(), corner++) = v.idx();
  }
  return result;
}

Eigen::Vector3d triangleNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b - a).cross(c - a);
}

double quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return edges > 0 ? 2 * std::sqrt(3.0) * triangleNormal(a, b, c).norm() / edges : 0;
}

/// The mesh under work with the wishes of the caller.
class Remesher {
 public:
  Remesher(HalfEdgeMesh& mesh, const std::function<double(const Eigen::Vector3d&)>& edge_length,
           const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& project)
      : mesh_(mesh), edge_length_(edge_length), project_(project) {}

  void splitLongEdges() {
    const auto count = static_cast<int>(mesh_.n_edges());
    for (int e = 0; e < count; ++e) {
      const EdgeHandle edge(e);
      if (mesh_.status(edge).deleted() || relativeLength(edge) < 4.0 / 3) continue;
      const auto h = mesh_.halfedge_handle(edge, 0);
      const Eigen::Vector3d middle = 0.5 * (from(h) + to(h));
      mesh_.split(edge, mesh_.add_vertex(toPoint(project_(middle))));
    }
  }

  void collapseShortEdges() {
    for (int e = 0; e < static_cast<int>(mesh_.n_edges()); ++e) {
      const EdgeHandle edge(e);
      if (mesh_.status(edge).deleted() || relativeLength(edge) > 4.0 / 5) continue;
      const auto one = mesh_.halfedge_handle(edge, 0), other = mesh_.halfedge_handle(edge, 1);
      if (collapseAllowed(one))
        mesh_.collapse(one);
      else if (collapseAllowed(other))
        mesh_.collapse(other);
    }
    mesh_.garbage_collection();
  }

  void flipEdges() {
    for (const auto edge : mesh_.edges())
      if (mesh_.is_flip_ok(edge) && flipImproves(edge)) mesh_.flip(edge);
  }

  /// Moves every vertex along its tangent plane towards the centroid of its triangles, then back onto the surface.
  void relax() {
    std::vector<Eigen::Vector3d> moved(mesh_.n_vertices());
    for (const auto v : mesh_.vertices()) moved[static_cast<std::size_t>(v.idx())] = relaxed(v);
    for (const auto v : mesh_.vertices())
      mesh_.set_point(v, toPoint(project_(moved[static_cast<std::size_t>(v.idx())])));
  }

 private:
  Position at(VertexHandle v) const { return Position(mesh_.point(v).data()); }
  Position from(HalfedgeHandle h) const { return at(mesh_.from_vertex_handle(h)); }
  Position to(HalfedgeHandle h) const { return at(mesh_.to_vertex_handle(h)); }

  double relative(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return (a - b).norm() / edge_length_(0.5 * (a + b));
  }
  double relativeLength(EdgeHandle edge) const {
    const auto h = mesh_.halfedge_handle(edge, 0);
    return relative(from(h), to(h));
  }

  /// Moving `from` onto `to` keeps the surface's topology, makes no edge too long and turns no triangle over.
  bool collapseAllowed(HalfedgeHandle h) const {
    if (!mesh_.is_collapse_ok(h)) return false;
    const auto gone = mesh_.from_vertex_handle(h), kept = mesh_.to_vertex_handle(h);
    const Eigen::Vector3d target = at(kept);
    for (const auto v : mesh_.vv_range(gone))
      if (v != kept && relative(at(v), target) > 4.0 / 3) return false;
    for (const auto outgoing : mesh_.voh_range(gone)) {
      const auto a = mesh_.to_vertex_handle(outgoing);
      const auto b = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(outgoing));
      if (a == kept || b == kept) continue;
      const Eigen::Vector3d before = triangleNormal(at(gone), at(a), at(b));
      const Eigen::Vector3d after = triangleNormal(target, at(a), at(b));
      if (after.dot(before) < 0.3 * after.norm() * before.norm()) return false;
    }
    return true;
  }

  /// A flip must bring the four valences nearer to six, or leave them as they are and improve the worse triangle; it
  /// must not fold the surface.
  bool flipImproves(EdgeHandle edge) const {
    const auto h = mesh_.halfedge_handle(edge, 0), g = mesh_.halfedge_handle(edge, 1);
    const auto a = mesh_.from_vertex_handle(h), b = mesh_.to_vertex_handle(h);
    const auto c = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h));
    const auto d = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(g));
    const auto off = [&](VertexHandle v, int change) {
      const int excess = static_cast<int>(mesh_.valence(v)) + change - 6;
      return excess * excess;
    };
    const int gain = off(a, 0) + off(b, 0) + off(c, 0) + off(d, 0) - off(a, -1) - off(b, -1) - off(c, 1) - off(d, 1);
    const Eigen::Vector3d pa = at(a), pb = at(b), pc = at(c), pd = at(d);
    const double before = std::min(quality(pa, pb, pc), quality(pb, pa, pd));
    const double after = std::min(quality(pc, pa, pd), quality(pd, pb, pc));
    const bool better = gain > 0 ? after > 0.6 * before : gain == 0 && after > before * (1 + 1e-9);
    if (!better) return false;
    const Eigen::Vector3d one = triangleNormal(pc, pa, pd), two = triangleNormal(pd, pb, pc);
    const Eigen::Vector3d surface = triangleNormal(pa, pb, pc) + triangleNormal(pb, pa, pd);
    return one.dot(surface) > 0.5 * one.norm() * surface.norm() && two.dot(surface) > 0.5 * two.norm() * surface.norm();
  }

  Eigen::Vector3d relaxed(VertexHandle v) const {
    const Eigen::Vector3d position = at(v);
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const auto h : mesh_.voh_range(v)) {
      const Eigen::Vector3d a = to(h), b = to(mesh_.next_halfedge_handle(h));
      const Eigen::Vector3d area = triangleNormal(position, a, b), middle = (position + a + b) / 3;
      const double size =
          edge_length_(middle);  // weights relative to the wanted size, or vertices drift to where it is large
      const double weight = area.norm() / (size * size);
      normal += area;
      centroid += weight * middle;
      weights += weight;
    }
    if (!(weights > 0)) return position;
    normal.normalize();
    const Eigen::Vector3d move = centroid / weights - position;
    return position + 0.8 * (move - move.dot(normal) * normal);
  }

  HalfEdgeMesh& mesh_;
  const std::function<double(const Eigen::Vector3d&)>& edge_length_;
  const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& project_;
};

}  // namespace

SurfaceMesh remeshIsotropically(const SurfaceMesh& mesh,
                                const std::function<double(const Eigen::Vector3d&)>& edge_length,
                                const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& project,
                                const RemeshingOptions& options) {
  HalfEdgeMesh half_edges = toHalfEdges(mesh);
  Remesher remesher(half_edges, edge_length, project);
  for (int round = 0; round < options.rounds; ++round) {
    remesher.splitLongEdges();
    remesher.collapseShortEdges();
    remesher.flipEdges();
    remesher.relax();
  }
  for (int round = 0; round < options.final_rounds; ++round) {
    remesher.flipEdges();
    remesher.relax();
  }
  return fromHalfEdges(half_edges);
}

}  // namespace shaped
