#include "core/registration/scan_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"

namespace shaped {
namespace {

Eigen::RowVector3d unitOrZero(const Eigen::RowVector3d& vector) {
  const double length = vector.norm();
  return length > 0 ? Eigen::RowVector3d(vector / length) : Eigen::RowVector3d::Zero();
}

Vertices unitRows(const Vertices& rows) {
  Vertices unit(rows.rows(), 3);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) unit.row(i) = unitOrZero(rows.row(i));
  return unit;
}

/// Both ends of the edge opposite a corner, the smaller first.
std::pair<std::int32_t, std::int32_t> edgeOpposite(const Faces& faces, Eigen::Index face, int corner) {
  return std::minmax(std::int32_t(faces(face, (corner + 1) % 3)), std::int32_t(faces(face, (corner + 2) % 3)));
}

std::vector<std::array<bool, 3>> boundaryEdges(const Faces& faces) {
  std::vector<std::pair<std::int32_t, std::int32_t>> edges;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int corner = 0; corner < 3; ++corner) edges.push_back(edgeOpposite(faces, f, corner));
  std::sort(edges.begin(), edges.end());
  std::vector<std::array<bool, 3>> boundary(static_cast<std::size_t>(faces.rows()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int corner = 0; corner < 3; ++corner) {
      const auto [first, last] = std::equal_range(edges.begin(), edges.end(), edgeOpposite(faces, f, corner));
      boundary[static_cast<std::size_t>(f)][static_cast<std::size_t>(corner)] = last - first == 1;
    }
  return boundary;
}

/// Of the boundary edge's corners only: a triangle that touches the boundary with one corner has that corner here too.
std::vector<bool> boundaryPoints(const Faces& faces, const std::vector<std::array<bool, 3>>& edges,
                                 Eigen::Index count) {
  std::vector<bool> boundary(static_cast<std::size_t>(count));
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int corner = 0; corner < 3; ++corner)
      if (edges[static_cast<std::size_t>(f)][static_cast<std::size_t>(corner)]) {
        const auto [one, other] = edgeOpposite(faces, f, corner);
        boundary[static_cast<std::size_t>(one)] = boundary[static_cast<std::size_t>(other)] = true;
      }
  return boundary;
}

}  // namespace

std::optional<std::string> ScanSurfaceOptions::firstViolation() const {
  if (normal_neighbours < 3) return "normal_neighbours = " + std::to_string(normal_neighbours) + ", want >= 3";
  if (rim.neighbours < 3) return "rim.neighbours = " + std::to_string(rim.neighbours) + ", want >= 3";
  if (!(rim.widest_gap > 0 && rim.widest_gap <= 360))
    return "rim.widest_gap = " + std::to_string(rim.widest_gap) + ", want (0, 360] degrees";
  return std::nullopt;
}

ScanSurface::ScanSurface(const Scan& scan, const ScanSurfaceOptions& options) : points_(scan.points) {
  requireUsableScan(scan, "scan");
  if (const auto violation = options.firstViolation()) throw InvalidInput("scan surface options", *violation);
  if (scan.faces.rows() > 0)
    prepareMesh(scan);
  else
    prepareCloud(scan, options);
}

void ScanSurface::prepareMesh(const Scan& scan) {
  faces_ = scan.faces;
  normals_ = scan.normals.rows() > 0 ? unitRows(scan.normals) : vertexNormals(faces_, points_);
  face_edges_ = boundaryEdges(faces_);
  boundary_ = boundaryPoints(faces_, face_edges_, points_.rows());
  triangles_.emplace(points_, faces_);
}

void ScanSurface::prepareCloud(const Scan& scan, const ScanSurfaceOptions& options) {
  cloud_.emplace(points_);
  oriented_ = scan.normals.rows() > 0;
  normals_ = oriented_ ? unitRows(scan.normals) : estimateNormals(*cloud_, options.normal_neighbours);
  boundary_ = findRim(*cloud_, normals_, oriented_, options.rim);
}

double ScanSurface::boundaryShare() const {
  return static_cast<double>(std::count(boundary_.begin(), boundary_.end(), true)) /
         static_cast<double>(points_.rows());
}

bool ScanSurface::onBoundary(const SurfacePoint& found) const {
  // The closest point of a triangle has a weight of exactly zero on an edge (closestPointOnTriangle).
  for (int corner = 0; corner < 3; ++corner) {
    if (found.barycentric[corner] == 1) return boundary_[static_cast<std::size_t>(faces_(found.face, corner))];
    if (found.barycentric[corner] == 0 &&
        face_edges_[static_cast<std::size_t>(found.face)][static_cast<std::size_t>(corner)])
      return true;
  }
  return false;
}

ScanPoint ScanSurface::closestOnMesh(const Eigen::RowVector3d& query) const {
  const SurfacePoint found = (*triangles_)(query);
  Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
  for (int corner = 0; corner < 3; ++corner)
    normal += found.barycentric[corner] * normals_.row(faces_(found.face, corner));
  return {found.position, unitOrZero(normal), found.distance, onBoundary(found), found.face};
}

ScanPoint ScanSurface::closest(const Eigen::RowVector3d& query) const {
  if (isMesh()) return closestOnMesh(query);
  if (!query.allFinite()) throw InvalidInput("query", "has a coordinate that is not a finite number");
  const NearPoint found = cloud_->nearest(query);
  return {points_.row(found.index), normals_.row(found.index), std::sqrt(found.squared_distance),
          boundary_[static_cast<std::size_t>(found.index)], found.index};
}

NormalAgreement compareNormals(const ScanSurface& scan, const Vertices& template_vertices, const Faces& template_faces,
                               double max_distance) {
  const Vertices normals = vertexNormals(template_faces, template_vertices);
  NormalAgreement agreement;
  Eigen::Index opposing = 0;
  for (Eigen::Index v = 0; v < template_vertices.rows(); ++v) {
    const ScanPoint found = scan.closest(template_vertices.row(v));
    const double cosine = found.normal.dot(normals.row(v));
    if (found.distance > max_distance || std::abs(cosine) < 0.5) continue;
    ++agreement.compared;
    opposing += cosine < 0;
  }
  if (agreement.compared > 0)
    agreement.opposing = static_cast<double>(opposing) / static_cast<double>(agreement.compared);
  return agreement;
}

Scan flipped(const Scan& scan) {
  Scan turned = scan;
  turned.normals = -scan.normals;
  turned.faces.col(1).swap(turned.faces.col(2));
  return turned;
}

}  // namespace shaped
