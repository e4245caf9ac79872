#include "core/mesh/coarsening.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <numeric>
#include <string>

#include "core/mesh/collapse_probe.h"
#include "core/mesh/group_quadrics.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

constexpr double kSmallestFloor = 1e-3;    ///< of the regularity, where relaxing ends
constexpr double kRegularityShift = 0.01;  ///< below it, differences in regularity no longer change the order

/// The decimater's view of a group of shapes: which collapses are legal and in which order they come.
class GroupModule : public OpenMesh::Decimater::ModBaseT<HalfEdgeMesh> {
 public:
  using Handle = OpenMesh::Decimater::ModHandleT<GroupModule>;

  explicit GroupModule(HalfEdgeMesh& mesh) : ModBaseT<HalfEdgeMesh>(mesh, false) {}

  void setShapes(const ShapeGroup& shapes, GroupQuadrics& quadrics) { shapes_ = &shapes, quadrics_ = &quadrics; }
  void setFloor(double floor) { floor_ = floor; }
  void setStop(std::stop_token stop) { stop_ = std::move(stop); }

  float collapse_priority(const CollapseInfo& collapse) override {
    if (stop_.stop_requested()) return ILLEGAL_COLLAPSE;
    gatherStar(collapse);
    const auto verdict = probe_.judge(*shapes_, star_, floor_);
    if (!verdict.acceptable) return ILLEGAL_COLLAPSE;
    const double loss = (verdict.before + kRegularityShift) / (verdict.after + kRegularityShift);
    return static_cast<float>(loss * loss * quadrics_->collapseError(*shapes_, star_.from, star_.to));
  }

  void postprocess_collapse(const CollapseInfo& collapse) override {
    quadrics_->merge(collapse.v0.idx(), collapse.v1.idx());
  }

 private:
  void gatherStar(const CollapseInfo& collapse) {
    star_.from = collapse.v0.idx();
    star_.to = collapse.v1.idx();
    star_.closed = !mesh().is_boundary(collapse.v0);
    star_.outer_edges.clear();
    star_.tips.clear();
    // At a boundary the vertex's half-edge is the boundary one, so the fan is met in order and without a gap.
    for (const auto spoke : mesh().voh_ccw_range(collapse.v0)) {
      if (mesh().is_boundary(spoke)) continue;
      const auto outer = mesh().next_halfedge_handle(spoke), across = mesh().opposite_halfedge_handle(outer);
      star_.outer_edges.push_back({mesh().from_vertex_handle(outer).idx(), mesh().to_vertex_handle(outer).idx()});
      star_.tips.push_back(
          mesh().is_boundary(across) ? -1 : mesh().to_vertex_handle(mesh().next_halfedge_handle(across)).idx());
    }
  }

  const ShapeGroup* shapes_ = nullptr;
  GroupQuadrics* quadrics_ = nullptr;
  double floor_ = 1;
  std::stop_token stop_;
  CollapseStar star_;
  CollapseProbe probe_;
};

void checkInput(const Topology& fine, const std::vector<Vertices>& shapes, const CoarseningOptions& options) {
  if (shapes.empty()) throw InvalidInput("shapes", "is empty; coarsening needs at least one shape");
  for (std::size_t s = 0; s < shapes.size(); ++s)
    requireValidShape(fine, shapes[s], "shapes[" + std::to_string(s) + "]");
  if (options.vertex_count < 4)
    throw InvalidInput("vertex_count", "is " + std::to_string(options.vertex_count) + ", want at least 4");
  for (std::size_t i = 0; i < options.protected_vertices.size(); ++i)
    if (const auto v = options.protected_vertices[i]; v < 0 || v >= fine.vertexCount())
      throw InvalidInput("protected_vertices[" + std::to_string(i) + "]",
                         "vertex " + std::to_string(v) + " is outside [0, " + std::to_string(fine.vertexCount()) + ")");
}

HalfEdgeMesh halfEdgesOf(const Topology& topology, const std::vector<std::int32_t>& protected_vertices) {
  HalfEdgeMesh mesh;
  mesh.request_vertex_status();  // ours beyond the decimater's life: it says what is left
  mesh.request_edge_status();
  mesh.request_face_status();
  const auto& faces = topology.faces();
  mesh.reserve(topology.vertexCount(), topology.edges().size(), static_cast<std::size_t>(faces.rows()));
  for (std::int32_t v = 0; v < topology.vertexCount(); ++v) mesh.add_vertex(HalfEdgeMesh::Point(0, 0, 0));
  using Vertex = HalfEdgeMesh::VertexHandle;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    mesh.add_face(Vertex(faces(f, 0)), Vertex(faces(f, 1)), Vertex(faces(f, 2)));
  for (const auto v : protected_vertices) mesh.status(Vertex(v)).set_locked(true);
  return mesh;
}

/// Collapses until the target is reached, relaxing the floor of regularity where it blocks every way.
void decimate(HalfEdgeMesh& mesh, const ShapeGroup& shapes, GroupQuadrics& quadrics, const CoarseningOptions& options) {
  OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(mesh);
  GroupModule::Handle handle;
  decimater.add(handle);
  decimater.module(handle).setShapes(shapes, quadrics);
  decimater.module(handle).setStop(options.stop);
  decimater.initialize();
  auto excess = mesh.n_vertices() - static_cast<std::size_t>(options.vertex_count);
  double floor = 1;
  while (excess > 0 && floor > kSmallestFloor && !options.stop.stop_requested()) {
    decimater.module(handle).setFloor(floor);
    const auto collapsed = decimater.decimate(excess);
    excess -= collapsed;
    // Collapses open ways for others, so the floor falls only after a sweep in vain.
    if (collapsed == 0) floor /= 2;
  }
}

Coarsening remainder(const HalfEdgeMesh& mesh) {
  Coarsening result;
  std::vector<std::int32_t> coarse_index(mesh.n_vertices(), -1);
  for (const auto v : mesh.vertices()) {  // skips what was collapsed
    coarse_index[v.idx()] = static_cast<std::int32_t>(result.kept.size());
    result.kept.push_back(v.idx());
  }
  std::vector<std::int32_t> corners;
  for (const auto face : mesh.faces())
    for (const auto v : mesh.fv_range(face)) corners.push_back(coarse_index[v.idx()]);
  Faces faces = Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
  result.coarse = std::make_shared<const Topology>(static_cast<std::int32_t>(result.kept.size()), std::move(faces));
  return result;
}

}  // namespace

Coarsening coarsen(const TopologyPtr& fine, const std::vector<Vertices>& shapes, const CoarseningOptions& options) {
  checkInput(*fine, shapes, options);
  if (fine->vertexCount() <= options.vertex_count) {
    Coarsening whole{fine, std::vector<std::int32_t>(static_cast<std::size_t>(fine->vertexCount()))};
    std::iota(whole.kept.begin(), whole.kept.end(), 0);
    return whole;
  }
  const ShapeGroup group(shapes);
  GroupQuadrics quadrics(*fine, group);
  auto mesh = halfEdgesOf(*fine, options.protected_vertices);
  decimate(mesh, group, quadrics, options);
  return remainder(mesh);
}

Vertices restrictTo(const Coarsening& coarsening, const Vertices& fine) {
  if (!coarsening.kept.empty() && coarsening.kept.back() >= fine.rows())
    throw InvalidInput("shape", "has " + std::to_string(fine.rows()) + " vertices, too few for this coarsening");
  return fine(coarsening.kept, Eigen::all);
}

}  // namespace shaped
