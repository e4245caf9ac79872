#pragma once

#include <optional>

#include "core/mesh/scan.h"
#include "core/registration/point_neighbourhoods.h"
#include "core/surface/closest_point.h"

namespace shaped {

struct ScanSurfaceOptions {
  int normal_neighbours = 16;                         ///< points that estimate a missing normal, >= 3
  RimOptions rim;                                     ///< of point scans; a mesh knows its boundary
  std::optional<std::string> firstViolation() const;  ///< "rim.neighbours = 2, want >= 3"
};

/// The point of a scan closest to another point.
struct ScanPoint {
  Eigen::RowVector3d position;
  Eigen::RowVector3d normal;  ///< unit, or zero where unknown (a triangle without area)
  double distance;            ///< from the query to `position`, m
  bool boundary;              ///< on an edge with one triangle, or a point at the rim of a point scan
  std::int32_t index;         ///< of the face in a mesh, of the point otherwise
};

/// A scan made ready for closest-point queries: a bounding volume hierarchy over a mesh, a k-d tree over points.
/// Missing normals are estimated. A query is const and may run from several threads at once.
class ScanSurface {
 public:
  /// Throws InvalidInput as requireUsableScan(scan, "scan") does, or naming the option that is out of range.
  explicit ScanSurface(const Scan& scan, const ScanSurfaceOptions& options = {});

  ScanPoint closest(const Eigen::RowVector3d& query) const;

  bool isMesh() const { return triangles_.has_value(); }
  /// False where normals were estimated, which leaves their sign open.
  bool hasOrientedNormals() const { return oriented_; }
  const Vertices& points() const { return points_; }
  /// N x 3, unit or zero.
  const Vertices& normals() const { return normals_; }
  /// Share of the points that lie on the boundary or rim, in [0, 1].
  double boundaryShare() const;

 private:
  void prepareMesh(const Scan& scan);
  void prepareCloud(const Scan& scan, const ScanSurfaceOptions& options);
  bool onBoundary(const SurfacePoint& found) const;
  ScanPoint closestOnMesh(const Eigen::RowVector3d& query) const;

  Vertices points_, normals_;
  Faces faces_;
  bool oriented_ = true;
  std::vector<bool> boundary_;                   ///< of each point
  std::vector<std::array<bool, 3>> face_edges_;  ///< of each face: whether the edge opposite each corner is boundary
  std::optional<ClosestPointQuery> triangles_;
  std::optional<PointTree> cloud_;
};

/// How the normals of a scan compare with those of a template that lies on it.
struct NormalAgreement {
  Eigen::Index compared = 0;  ///< template vertices with a scan point near enough and a normal along or against theirs
  double opposing = 0;        ///< share of them whose scan normal points the other way, in [0, 1]
};

/// Compares the normals of an aligned template with those of the closest scan points within `max_distance` [m]; pairs
/// at more than 60 degrees to each other's line say nothing and are left out. A share near 1 means that the scan's
/// normals point inwards, or that its triangles are wound clockwise; near a half, that they have no common sense.
NormalAgreement compareNormals(const ScanSurface& scan, const Vertices& template_vertices, const Faces& template_faces,
                               double max_distance);

/// The scan with its normals and its triangles turned over.
Scan flipped(const Scan& scan);

}  // namespace shaped
