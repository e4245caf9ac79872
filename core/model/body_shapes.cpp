#include "core/model/body_shapes.h"

#include <cmath>
#include <numbers>

#include "core/body/body_fit.h"
#include "core/mesh/quality.h"
#include "core/model/body_take_fitter.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Of fitBody, where the shape itself is asked for and not what is probable: enough to settle what it leaves open.
constexpr double kHardlyAnyPrior = 1e-3;

PostureTemplate referenceOf(const BodyParts& parts) {
  return {parts.topology, parts.mean, Rig{parts.skeleton, parts.regressor * parts.mean, parts.weights, parts.limits},
          parts.regressor};
}

ShapeScore scoreOf(const Eigen::VectorXd& identity, const Eigen::VectorXd& deviations) {
  ShapeScore score;
  score.mahalanobis = identity.norm();
  score.log_likelihood = -0.5 * identity.squaredNorm() - deviations.array().log().sum() -
                         0.5 * static_cast<double>(identity.size()) * std::log(2 * std::numbers::pi);
  return score;
}

std::size_t bytesOf(const SkinWeights& matrix) {
  return static_cast<std::size_t>(matrix.nonZeros()) * (sizeof(double) + sizeof(int));
}

}  // namespace

BodyCoefficients coefficientsOf(const BodyState& state, Eigen::Index modes) {
  const Eigen::VectorXd pose = toVector(state.pose);
  BodyCoefficients coefficients{Eigen::VectorXd::Zero(modes + pose.size())};
  coefficients.numbers.head(state.identity.size()) = state.identity;
  coefficients.numbers.tail(pose.size()) = pose;
  return coefficients;
}

BodyState stateOf(const BodyModel& model, const BodyCoefficients& coefficients) {
  const auto& numbers = coefficients.numbers;
  const Eigen::Index modes = model.modeCount(), joints = model.skeleton().jointCount();
  if (numbers.size() != modes + 3 + 3 * joints)
    throw InvalidInput("coefficients.body",
                       "has " + std::to_string(numbers.size()) + " numbers, want " +
                           std::to_string(modes + 3 + 3 * joints) + ": identity (" + std::to_string(modes) +
                           "), translation (3), rotations (3 for each of " + std::to_string(joints) + " joints)");
  for (Eigen::Index i = 0; i < numbers.size(); ++i)
    if (!std::isfinite(numbers[i]))
      throw InvalidInput("coefficients.body[" + std::to_string(i) + "]", "is not a finite number");
  return {numbers.head(modes), poseFrom(numbers.tail(3 + 3 * joints))};
}

BodyShapes::BodyShapes(BodyModel model, BodyTrainingRecord training, std::optional<JacobianFieldWeights> field)
    : model_(std::make_shared<const BodyModel>(std::move(model))),
      training_(std::move(training)),
      reference_(referenceOf(model_->parts())),
      field_(std::move(field)) {
  if (field_) const JacobianField complete(*field_);  // says what does not fit
}

std::shared_ptr<const FieldDeformation> BodyShapes::field(const std::stop_token& stop) const {
  if (!field_) return nullptr;
  return deformation_.get(
      stop, [this](const std::stop_token& asked) { return FieldDeformation::make(*model_, *field_, asked); });
}

std::size_t BodyShapes::bytes() const {
  const auto& parts = model_->parts();
  // The model keeps its modes as they are and scaled; the template repeats mean, weights and regressor.
  const auto numbers = 2 * (parts.modes.size() + parts.mean.size()) + model_->shapeModes().joints.size();
  const auto topology =
      9 * static_cast<std::size_t>(parts.topology->faces().rows()) + 2 * parts.topology->edges().size();
  const auto deformation = field();
  return sizeof(double) * static_cast<std::size_t>(numbers) + sizeof(std::int32_t) * topology +
         2 * (bytesOf(parts.weights) + bytesOf(parts.regressor)) + (deformation ? deformation->bytes() : 0);
}

void BodyShapes::warm() const {
  model_->posed(model_->meanState());
  field();
}

Solved<ShapeProjection> BodyShapes::project(const Vertices& shape, const ProjectionOptions& options) const {
  requireValidShape(topology(), shape, "shape");
  if (options.modes < 0 || options.modes > modes())
    throw InvalidInput("modes",
                       std::to_string(options.modes) + ", want at most the model's " + std::to_string(modes()));
  const Eigen::Index used = options.modes == 0 ? modes() : options.modes;
  const BodyModel model = model_->truncated(used);
  BodyFitOptions fitting;
  fitting.prior = kHardlyAnyPrior;
  fitting.stop = options.stop;
  const BodyState start{Eigen::VectorXd::Zero(used), estimatePose(reference_, shape)};
  const auto solved = fitBody(model, start, vertexTargets(shape), fitting);
  ShapeProjection found;
  const auto& identity = solved.solution.identity;
  const auto& deviations = model.parts().deviations;
  found.shape = model.posed(solved.solution).vertices();
  found.point = coefficientsOf(solved.solution, modes());
  found.tangent_coordinates = identity.cwiseProduct(deviations);
  found.score = scoreOf(identity, deviations);
  found.score.residual_distance = rmsVertexDistance(found.shape, shape);
  found.smallest_area_ratio = smallestAreaRatio(topology().faces(), mean(), found.shape);
  return {std::move(found), solved};
}

Solved<SynthesizedShape> BodyShapes::synthesize(const ModelPoint& point, const SynthesisOptions&) const {
  const auto* coefficients = std::get_if<BodyCoefficients>(&point);
  if (!coefficients)
    throw InvalidInput("coefficients", std::string("are those of a Shell PGA model, and the model is of kind ") +
                                           kBodyKind + ": want body");
  Vertices shape = model_->posed(stateOf(*model_, *coefficients)).vertices();
  const double ratio = smallestAreaRatio(topology().faces(), mean(), shape);
  return {{std::move(shape), ratio}, {Termination::kConverged, 0, 0}};
}

std::unique_ptr<TakeFitter> BodyShapes::takeFitter(const MarkerSet& markers, const TakeOptions& options) const {
  return std::make_unique<BodyTakeFitter>(model_, markers, options);
}

std::int64_t BodyShapes::publish(const ModelDirectory& directory, const std::string& name,
                                 const nlohmann::json& provenance) const {
  return publishBody(directory, name, *model_, training_, provenance, field_ ? &*field_ : nullptr);
}

}  // namespace shaped
