#pragma once

#include <optional>
#include <vector>

#include "core/mesh/alignment.h"
#include "core/mesh/scan.h"
#include "tests/support/shapes.h"

namespace shaped::test {

/// A closed body about 3 m long without any symmetry: a tapered tube, bent and twisted out of the plane.
Mesh hook();

/// Points all over a mesh with its normals.
Scan scanPoints(const Mesh& mesh, int count);

/// The scan of a mesh as it stands.
Scan scanMesh(const Mesh& mesh);

/// The points that a predicate keeps, with their normals.
template <class Keep>
Scan kept(const Scan& scan, const Keep& keep) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index p = 0; p < scan.points.rows(); ++p)
    if (keep(Eigen::RowVector3d(scan.points.row(p)))) rows.push_back(p);
  Scan part{scan.points(rows, Eigen::all), {}, {}};
  if (scan.normals.rows() > 0) part.normals = scan.normals(rows, Eigen::all);
  return part;
}

Scan moved(const Scan& scan, const RigidMotion& motion);

/// Replaces every `stride`-th point by one anywhere in the bounding box, enlarged by `margin`.
Scan withStrayPoints(Scan scan, int stride, double margin, unsigned seed);

RigidMotion randomMotion(unsigned seed);

/// A simulated scan of the body data set with what it was made of.
struct BodyScan {
  Scan scan;
  Vertices truth;    ///< V x 3, in the scan's place
  RigidMotion pose;  ///< of the data set: truth = pose(body)
};

/// The template that body scans are fitted with: the mean of all identities. Nothing without the data.
std::optional<Mesh> meanBody();
BodyScan bodyScan(int number);

}  // namespace shaped::test
