#include "core/surface/closest_point.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/numerics/error.h"
#include "core/surface/triangles.h"

namespace shaped {
namespace {

/// Parameter in [0, 1] of the point closest to `query` on the segment from `from` to `to`; 0 for a segment of no
/// length.
double closestOnSegment(const Eigen::RowVector3d& query, const Eigen::RowVector3d& from, const Eigen::RowVector3d& to) {
  const Eigen::RowVector3d along = to - from;
  const double length = along.squaredNorm();
  return length > 0 ? std::clamp((query - from).dot(along) / length, 0.0, 1.0) : 0;
}

/// Where the query's foot on the triangle's plane lies inside the triangle; false when outside or without area.
bool interiorFoot(const Eigen::RowVector3d& query, const Eigen::RowVector3d& a, const Eigen::RowVector3d& b,
                  const Eigen::RowVector3d& c, Eigen::RowVector3d& barycentric) {
  const Eigen::RowVector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (!(area > 0)) return false;
  const Eigen::RowVector3d aq = query - a;
  const double weight_b = aq.cross(ac).dot(normal) / area, weight_c = ab.cross(aq).dot(normal) / area;
  barycentric << 1 - weight_b - weight_c, weight_b, weight_c;
  return barycentric.minCoeff() >= 0;
}

/// The nearest single-precision number not above the value.
float roundDown(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}

float roundUp(double value) { return -roundDown(-value); }

}  // namespace

TrianglePoint closestPointOnTriangle(const Eigen::RowVector3d& query, const Eigen::RowVector3d& a,
                                     const Eigen::RowVector3d& b, const Eigen::RowVector3d& c) {
  TrianglePoint best{{}, {}, std::numeric_limits<double>::infinity()};
  const auto offer = [&](const Eigen::RowVector3d& barycentric) {
    const Eigen::RowVector3d position = barycentric[0] * a + barycentric[1] * b + barycentric[2] * c;
    const double squared_distance = (query - position).squaredNorm();
    if (squared_distance < best.squared_distance) best = {barycentric, position, squared_distance};
  };
  // In a sliver the foot may be rounding noise, yet it is a point of the triangle: the edges, always tried, then win.
  Eigen::RowVector3d foot;
  if (interiorFoot(query, a, b, c, foot)) offer(foot);
  const Eigen::RowVector3d* corners[] = {&a, &b, &c};
  for (int from = 0; from < 3; ++from) {
    const int to = (from + 1) % 3;
    const double t = closestOnSegment(query, *corners[from], *corners[to]);
    Eigen::RowVector3d barycentric = Eigen::RowVector3d::Zero();
    barycentric[from] = 1 - t;
    barycentric[to] = t;
    offer(barycentric);
  }
  return best;
}

/// Embree's bounding volume hierarchy over the triangles, as user geometry so that our own doubles decide.
struct ClosestPointQuery::Hierarchy {
  Vertices vertices;  ///< relative to `centre`
  Faces faces;
  Eigen::RowVector3d centre;
  double extent = 0;  ///< largest absolute coordinate relative to the centre
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Hierarchy(const Vertices& mesh_vertices, const Faces& mesh_faces) : faces(mesh_faces) {
    centre = 0.5 * (mesh_vertices.colwise().minCoeff() + mesh_vertices.colwise().maxCoeff());
    vertices = mesh_vertices.rowwise() - centre;
    extent = vertices.cwiseAbs().maxCoeff();
    device = rtcNewDevice("threads=1");
    scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(faces.rows()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, &Hierarchy::bounds, nullptr);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }

  ~Hierarchy() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  Hierarchy(const Hierarchy&) = delete;
  Hierarchy& operator=(const Hierarchy&) = delete;

  static void bounds(const RTCBoundsFunctionArguments* call) {
    const auto& self = *static_cast<const Hierarchy*>(call->geometryUserPtr);
    const auto corners = self.vertices(self.faces.row(call->primID).transpose().eval(), Eigen::all).eval();
    const Eigen::RowVector3d low = corners.colwise().minCoeff(), high = corners.colwise().maxCoeff();
    RTCBounds& box = *call->bounds_o;
    box.lower_x = roundDown(low[0]), box.lower_y = roundDown(low[1]), box.lower_z = roundDown(low[2]);
    box.upper_x = roundUp(high[0]), box.upper_y = roundUp(high[1]), box.upper_z = roundUp(high[2]);
  }

  /// One search under way: the query in double precision and the best point so far.
  struct Search {
    const Hierarchy& hierarchy;
    Eigen::RowVector3d query;
    double margin;  ///< covers the rounding of the query and of Embree's box distances
    std::int32_t face = -1;
    TrianglePoint best{{}, {}, std::numeric_limits<double>::infinity()};
  };

  static bool visit(RTCPointQueryFunctionArguments* call) {
    auto& search = *static_cast<Search*>(call->userPtr);
    const auto& [vertices, faces] = std::tie(search.hierarchy.vertices, search.hierarchy.faces);
    const auto face = static_cast<std::int32_t>(call->primID);
    const TrianglePoint found = closestPointOnTriangle(search.query, vertices.row(faces(face, 0)),
                                                       vertices.row(faces(face, 1)), vertices.row(faces(face, 2)));
    const bool tie = found.squared_distance == search.best.squared_distance && face < search.face;
    if (found.squared_distance >= search.best.squared_distance && !tie) return false;
    search.best = found;
    search.face = face;
    call->query->radius = roundUp(std::sqrt(found.squared_distance) + search.margin);
    return true;
  }
};

ClosestPointQuery::ClosestPointQuery(const Vertices& vertices, const Faces& faces) {
  requireTriangles(vertices, faces);
  hierarchy_ = std::make_unique<Hierarchy>(vertices, faces);
}

ClosestPointQuery::~ClosestPointQuery() = default;
ClosestPointQuery::ClosestPointQuery(ClosestPointQuery&&) noexcept = default;
ClosestPointQuery& ClosestPointQuery::operator=(ClosestPointQuery&&) noexcept = default;

SurfacePoint ClosestPointQuery::operator()(const Eigen::RowVector3d& point) const {
  if (!point.allFinite()) throw InvalidInput("point", "has a coordinate that is not a finite number");
  const Eigen::RowVector3d local = point - hierarchy_->centre;
  const double margin = 1e-6 * (local.cwiseAbs().maxCoeff() + hierarchy_->extent);
  Hierarchy::Search search{*hierarchy_, local, margin};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  RTCPointQuery query{static_cast<float>(local[0]), static_cast<float>(local[1]), static_cast<float>(local[2]), 0,
                      std::numeric_limits<float>::infinity()};
  rtcPointQuery(hierarchy_->scene, &query, &context, &Hierarchy::visit, &search);
  return {search.face, search.best.barycentric, search.best.position + hierarchy_->centre,
          std::sqrt(search.best.squared_distance)};
}

Eigen::VectorXd distancesToSurface(const Vertices& points, const Vertices& vertices, const Faces& faces) {
  const ClosestPointQuery closest(vertices, faces);
  Eigen::VectorXd distances(points.rows());
  for (Eigen::Index p = 0; p < points.rows(); ++p) distances[p] = closest(points.row(p)).distance;
  return distances;
}

}  // namespace shaped
