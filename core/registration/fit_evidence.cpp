#include "core/registration/fit_evidence.h"

#include <array>
#include <cmath>
#include <limits>

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

Eigen::VectorXd scanOffsets(const Vertices& vertices, const Vertices& normals, const Scan& scan) {
  Eigen::VectorXd offsets = Eigen::VectorXd::Constant(vertices.rows(), std::numeric_limits<double>::quiet_NaN());
  const PointTree tree(scan.points);
  const double farthest = std::pow(kFarthest * boundingBoxDiagonal(vertices), 2);
  std::array<NearPoint, kPointsAnOffset> near{};
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const auto found = tree.nearest(vertices.row(v), near);
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < found; ++i) {
      const auto point = near[i].index;
      if (near[i].squared_distance > farthest || scan.normals.row(point).dot(normals.row(v)) < kLeastCosine) continue;
      sum += normals.row(v).dot(scan.points.row(point) - vertices.row(v));
      ++count;
    }
    if (count > 0) offsets[v] = sum / count;
  }
  return offsets;
}

FitEvidence evidenceOf(const BodyState& state, const Vertices& rest, const Faces& faces, const Scan& scan) {
  const Eigen::VectorXd offsets = scanOffsets(rest, vertexNormals(faces, rest), scan);
  FitEvidence evidence{offsets.array().isNaN().select(0, offsets), {}};
  const Eigen::Index turns = 3 * (state.pose.rotations.rows() - 1);
  evidence.state.resize(state.identity.size() + turns);
  const Vertices joints = state.pose.rotations.bottomRows(turns / 3) / kTurnUnit;
  evidence.state << state.identity, Eigen::Map<const Eigen::VectorXd>(joints.data(), turns);
  return evidence;
}

}  // namespace shaped
