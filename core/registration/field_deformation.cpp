#include "core/registration/field_deformation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"
#include "core/registration/fit_evidence.h"
#include "core/registration/pose_refit.h"
#include "core/registration/scan_checks.h"

namespace shaped {
namespace {

/// Of T. Two bones that share a place evenly leave cos^2 of half the angle between them: 0.1 is at 143 degrees.
constexpr double kLeastDeterminant = 0.1;

void require(const RestScanOptions& options) {
  if (const auto problem = unlessPositive("max_distance", options.max_distance))
    throw InvalidInput("options", *problem);
  if (!(options.max_normal_angle > 0 && options.max_normal_angle <= 180))
    throw InvalidInput("options", "max_normal_angle = " + std::to_string(options.max_normal_angle) + ", want (0, 180]");
  if (options.points < 1) throw InvalidInput("options", "points = " + std::to_string(options.points) + ", want >= 1");
}

/// A point with its normal.
struct OrientedPoint {
  Eigen::RowVector3d position, normal;
};

/// The posed surface of a body and the ways back to rest.
class WayBack {
 public:
  WayBack(const BodyModel& model, const BodyState& state, const RestScanOptions& options)
      : faces_(model.topology()->faces()),
        skin_(model.posed(state)),
        rest_(model.rest(state.identity)),
        normals_(vertexNormals(faces_, skin_.vertices())),
        closest_(skin_.vertices(), faces_),
        max_distance_(options.max_distance * boundingBoxDiagonal(model.parts().mean)),
        least_cosine_(std::cos(options.max_normal_angle * std::numbers::pi / 180)) {}

  /// oriented: whether the normal's sign means something. Nothing for a point that is left out.
  std::optional<OrientedPoint> operator()(OrientedPoint point, bool oriented) const {
    const SurfacePoint foot = closest_(point.position);
    if (foot.distance > max_distance_) return std::nullopt;
    if (!turnedAlong(meanOfCorners(normals_, foot).normalized(), oriented, point.normal)) return std::nullopt;
    Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
    for (int c = 0; c < 3; ++c) blend += foot.barycentric[c] * skin_.blend(faces_(foot.face, c));
    if (blend.determinant() < kLeastDeterminant) return std::nullopt;
    const Eigen::Vector3d offset = (point.position - foot.position).transpose();
    // Normals go by the transposed inverse: what T does to places, T^T undoes for them.
    return OrientedPoint{meanOfCorners(rest_, foot) + (blend.inverse() * offset).transpose(),
                         (blend.transpose() * point.normal.transpose()).normalized().transpose()};
  }

 private:
  Eigen::RowVector3d meanOfCorners(const Vertices& values, const SurfacePoint& at) const {
    Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) mean += at.barycentric[c] * values.row(faces_(at.face, c));
    return mean;
  }

  /// Whether a normal (zero: unknown) agrees with the surface's, to whose side it is turned where it has no sign.
  bool turnedAlong(const Eigen::RowVector3d& surface, bool oriented, Eigen::RowVector3d& normal) const {
    if (normal.isZero(0) || surface.isZero(0)) return true;
    if (!oriented && normal.dot(surface) < 0) normal = -normal;
    return normal.dot(surface) >= least_cosine_;
  }

  const Faces& faces_;
  PosedSkin skin_;
  Vertices rest_, normals_;
  ClosestPointQuery closest_;
  double max_distance_, least_cosine_;
};

}  // namespace

Scan scanAtRest(const BodyModel& model, const BodyState& state, const ScanSurface& scan,
                const RestScanOptions& options) {
  require(options);
  const WayBack way_back(model, state, options);
  const Eigen::Index count = scan.points().rows(), looked_at = std::min<Eigen::Index>(count, options.points);
  Scan rest{Vertices(looked_at, 3), Vertices(looked_at, 3), {}};
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < looked_at; ++i) {
    const Eigen::Index row = i * count / looked_at;
    const auto carried = way_back({scan.points().row(row), scan.normals().row(row)}, scan.hasOrientedNormals());
    if (!carried) continue;
    rest.points.row(kept) = carried->position;
    rest.normals.row(kept) = carried->normal;
    ++kept;
  }
  rest.points.conservativeResize(kept, Eigen::NoChange);
  rest.normals.conservativeResize(kept, Eigen::NoChange);
  return rest;
}

Vertices smoothDisplacements(const FieldReference& reference, const SmoothPrior& prior, const Vertices& rest,
                             const Scan& scan) {
  const Vertices normals = vertexNormals(reference.poisson->topology().faces(), rest);
  return smoothResidual(reference.spectrum, prior, normals, scanOffsets(rest, normals, scan));
}

std::shared_ptr<const FieldDeformation> FieldDeformation::make(const BodyModel& model, JacobianFieldWeights weights,
                                                               const std::stop_token& stop) {
  auto reference = makeFieldReference(model.topology(), model.parts().mean, stop);
  if (!reference) return nullptr;
  return std::make_shared<const FieldDeformation>(std::make_shared<const FieldReference>(std::move(*reference)),
                                                  std::move(weights));
}

FieldDeformation::FieldDeformation(std::shared_ptr<const FieldReference> reference, JacobianFieldWeights weights)
    : reference_(std::move(reference)), field_(std::move(weights)) {
  if (const auto& regression = field_.weights().regression) regression_.emplace(*regression);
}

std::optional<RestBody> FieldDeformation::atRest(const BodyModel& model, const BodyState& state,
                                                 const ScanSurface& scan, const ModelFitOptions& fit) const {
  if (model.topology()->id() != reference_->poisson->topology().id())
    throw InvalidInput("model", "is of another topology than the field's reference: make the field's of this model");
  Scan seen = scanAtRest(model, state, scan);
  if (seen.points.rows() < kFewestScanPoints) return std::nullopt;
  const auto& faces = model.topology()->faces();
  Vertices rest = model.rest(state.identity);
  Pose pose = state.pose;
  if (regression_) {
    rest += regression_->predict(evidenceOf(state, rest, faces, seen));
    const auto start = refitPose(model, rest, pose, scan, fit, PoseRefit::kRough);
    pose = start.state.pose;
    seen = scanAtRest(start.body, start.state, scan);
    if (seen.points.rows() < kFewestScanPoints) return std::nullopt;
  }
  if (const auto& prior = field_.weights().smoothness) rest += smoothDisplacements(*reference_, *prior, rest, seen);
  if (!isSilent(field_.weights())) {
    const auto features = jacobianFieldFeatures(*reference_, rest, seen, field_.weights().scaling);
    const auto jacobians = field_.predict(features);
    if (!jacobians.allFinite()) return std::nullopt;
    rest = reference_->poisson->solve(jacobians, features.centroids);
  }
  return RestBody{std::move(rest), std::move(pose)};
}

std::optional<DeformedBody> FieldDeformation::deform(const BodyModel& model, const BodyState& state,
                                                     const ScanSurface& scan, const ModelFitOptions& fit,
                                                     const TipOptions& tips) const {
  auto found = atRest(model, state, scan, fit);
  if (!found) return std::nullopt;
  auto body = refitPose(model, found->rest, found->pose, scan, fit, regression_ ? PoseRefit::kFine : PoseRefit::kFull);
  if (seatTips(scan, body.body, body.state.identity, body.state.pose, tips, fit.stop) > 0)
    body = refitPose(model, found->rest, body.state.pose, scan, fit, PoseRefit::kFine);
  return DeformedBody{std::move(found->rest), body.state.pose, body.posed()};
}

std::size_t FieldDeformation::bytes() const {
  const auto& weights = field_.weights();
  const auto& spectrum = reference_->spectrum;
  Eigen::Index numbers = reference_->signatures.size();
  for (const auto* net : {&weights.source_net, &weights.scan_net, &weights.mlp})
    for (const auto& layer : *net) numbers += layer.weight.size() + layer.bias.size();
  return reference_->poisson->bytes() + (regression_ ? regression_->bytes() : 0) +
         sizeof(double) * static_cast<std::size_t>(reference_->shape.size() + spectrum.eigenfunctions.size() +
                                                   spectrum.areas.size()) +
         sizeof(float) * static_cast<std::size_t>(numbers);
}

}  // namespace shaped
