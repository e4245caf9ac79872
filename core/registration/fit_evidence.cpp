#include "core/registration/fit_evidence.h"

#include <array>
#include <cmath>

#include "core/mesh/quality.h"
#include "core/surface/point_tree.h"

namespace shaped {
namespace {

constexpr std::size_t kPointsAnOffset = 8;
/// Of the diagonal of the bounding box.
constexpr double kFarthest = 0.02;
constexpr double kLeastCosine = 0.6;
constexpr double kTurnUnit = 0.1;  ///< rad

}  // namespace

FitEvidence evidenceOf(const BodyState& state, const Vertices& rest, const Faces& faces, const Scan& scan) {
  FitEvidence evidence{Eigen::VectorXd::Zero(rest.rows()), {}};
  const Vertices normals = vertexNormals(faces, rest);
  const PointTree tree(scan.points);
  const double farthest = std::pow(kFarthest * boundingBoxDiagonal(rest), 2);
  std::array<NearPoint, kPointsAnOffset> near{};
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    const auto found = tree.nearest(rest.row(v), near);
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < found; ++i) {
      const auto point = near[i].index;
      if (near[i].squared_distance > farthest || scan.normals.row(point).dot(normals.row(v)) < kLeastCosine) continue;
      sum += normals.row(v).dot(scan.points.row(point) - rest.row(v));
      ++count;
    }
    if (count > 0) evidence.offsets[v] = sum / count;
  }
  const Eigen::Index turns = 3 * (state.pose.rotations.rows() - 1);
  evidence.state.resize(state.identity.size() + turns);
  const Vertices joints = state.pose.rotations.bottomRows(turns / 3) / kTurnUnit;
  evidence.state << state.identity, Eigen::Map<const Eigen::VectorXd>(joints.data(), turns);
  return evidence;
}

}  // namespace shaped
