#include "core/registration/fitting_report.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/quality.h"

namespace shaped {
namespace {

std::vector<bool> turnedTriangles(const Faces& faces, const Vertices& shape) {
  const Vertices normals = faceNormals(faces, shape), around = vertexNormals(faces, shape);
  std::vector<bool> turned(static_cast<std::size_t>(faces.rows()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d mean = around.row(faces(f, 0)) + around.row(faces(f, 1)) + around.row(faces(f, 2));
    turned[static_cast<std::size_t>(f)] = normals.row(f).dot(mean) < 0;
  }
  return turned;
}

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

double slidingSquare(const Eigen::RowVector3d& difference, const Eigen::RowVector3d& normal, double sliding) {
  if (normal.squaredNorm() == 0) return difference.squaredNorm();
  const double along = difference.dot(normal);
  return sliding * along * along + (1 - sliding) * difference.squaredNorm();
}

Eigen::Index flippedTriangles(const Faces& faces, const Vertices& reference, const Vertices& shape) {
  const auto before = turnedTriangles(faces, reference), after = turnedTriangles(faces, shape);
  Eigen::Index flipped = 0;
  for (std::size_t f = 0; f < after.size(); ++f) flipped += after[f] && !before[f];
  return flipped;
}

FittingReport reportFit(const ScanSurface& scan, const Topology& topology, const Vertices& placed,
                        const Vertices& fitted, const CorrespondenceGates& gates) {
  const auto found = findCorrespondences(scan, fitted, vertexNormals(topology.faces(), fitted), gates);
  std::vector<double> distances;
  for (Eigen::Index v = 0; v < fitted.rows(); ++v)
    if (found.accepted[v] > 0)
      distances.push_back(std::sqrt(slidingSquare(fitted.row(v) - found.targets.row(v), found.normals.row(v), 1)));
  const auto count = static_cast<double>(fitted.rows());
  FittingReport report;
  report.median_distance = percentile(distances, 0.5);
  report.percentile_95_distance = percentile(distances, 0.95);
  report.too_far = static_cast<double>(found.too_far) / count;
  report.wrong_normal = static_cast<double>(found.wrong_normal) / count;
  report.at_boundary = static_cast<double>(found.at_boundary) / count;
  report.gated_out = report.too_far + report.wrong_normal + report.at_boundary;
  report.smallest_area_ratio = smallestAreaRatio(topology.faces(), placed, fitted);
  report.flipped = flippedTriangles(topology.faces(), placed, fitted);
  return report;
}

}  // namespace shaped
