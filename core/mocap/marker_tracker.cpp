#include "core/mocap/marker_tracker.h"

#include <cmath>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"

namespace shaped {
namespace {

bool seen(const AnchorTarget& target) { return target.weight > 0; }

Vertices wantedPositions(const std::vector<AnchorTarget>& targets) {
  Vertices wanted(static_cast<Eigen::Index>(targets.size()), 3);
  for (std::size_t l = 0; l < targets.size(); ++l) wanted.row(static_cast<Eigen::Index>(l)) = targets[l].position;
  return wanted;
}

Eigen::VectorXd weightsOf(const std::vector<AnchorTarget>& targets) {
  Eigen::VectorXd weights(static_cast<Eigen::Index>(targets.size()));
  for (std::size_t l = 0; l < targets.size(); ++l) weights[static_cast<Eigen::Index>(l)] = targets[l].weight;
  return weights;
}

}  // namespace

std::optional<std::string> MarkerTrackerOptions::firstViolation() const {
  const auto number = [](double value) { return std::to_string(value); };
  if (!(prior_weight > 0)) return "prior_weight = " + number(prior_weight) + ", want > 0";
  if (!(robust_scale >= 0)) return "robust_scale = " + number(robust_scale) + ", want >= 0";
  if (alternations < 1) return "alternations = " + std::to_string(alternations) + ", want >= 1";
  if (first_alternations < 1) return "first_alternations = " + std::to_string(first_alternations) + ", want >= 1";
  if (scale && !(*scale > 0)) return "scale = " + number(*scale) + ", want > 0";
  return std::nullopt;
}

MarkerTracker::MarkerTracker(std::shared_ptr<const Submanifold> submanifold, std::vector<Anchor> anchors,
                             MarkerTrackerOptions options)
    : submanifold_(std::move(submanifold)), anchors_(std::move(anchors)), options_(std::move(options)),
      size_(boundingBoxDiagonal(submanifold_->pga().mean)), shape_(submanifold_->pga().mean), prior_(shape_) {
  if (const auto violation = options_.firstViolation()) throw InvalidInput("options", *violation);
  if (anchors_.size() < 3)
    throw InvalidInput("marker_set", "has " + std::to_string(anchors_.size()) + " markers, a fit needs at least three");
  if (options_.scale) scale_ = *options_.scale;
}

std::vector<AnchorTarget> MarkerTracker::targetsOf(const MarkerPositions& markers) const {
  if (markers.rows() != static_cast<Eigen::Index>(anchors_.size()))
    throw InvalidInput("markers", "has " + std::to_string(markers.rows()) + " rows, the marker set has " +
                                      std::to_string(anchors_.size()) + " markers");
  std::vector<AnchorTarget> targets;
  for (std::size_t l = 0; l < anchors_.size(); ++l) {
    const Eigen::Vector3d position = markers.row(static_cast<Eigen::Index>(l)).transpose() / scale_;
    const bool here = position.allFinite();
    targets.push_back({anchors_[l], here ? position : Eigen::Vector3d::Zero(), here ? 1.0 : 0.0});
  }
  return targets;
}

void MarkerTracker::followRigidly(const std::vector<AnchorTarget>& targets) {
  const Vertices points = anchorPositions(submanifold_->calculus().topology(), targets, shape_);
  shape_ = apply(alignRigidly(points, wantedPositions(targets), weightsOf(targets)), shape_);
}

/// The mean, moved and scaled by its marker points.
void MarkerTracker::place(const std::vector<AnchorTarget>& targets) {
  shape_ = prior_ = submanifold_->pga().mean;
  followRigidly(targets);
}

/// Geman-McClure weights (c^2 / (c^2 + r^2))^2 of the current residuals.
void MarkerTracker::updateWeights(std::vector<AnchorTarget>& targets) const {
  if (options_.robust_scale == 0) return;
  const double c = options_.robust_scale * size_;
  for (auto& target : targets) {
    if (!seen(target)) continue;
    const double r2 = (position(target.anchor, submanifold_->calculus().topology().faces(), shape_) - target.position).squaredNorm();
    const double ratio = c * c / (c * c + r2);
    target.weight = ratio * ratio;
  }
}

Outcome MarkerTracker::fitShape(std::vector<AnchorTarget>& targets) {
  auto fit = fitAnchored(submanifold_->calculus(), prior_, targets, shape_,
                         {options_.prior_weight, 60, 1e-5, options_.submanifold.stop});
  shape_ = std::move(fit.solution);
  return fit;
}

Outcome MarkerTracker::projectShape() {
  auto projected = submanifold_->project(shape_, options_.submanifold, projection_.geodesic.empty() ? nullptr : &projection_);
  if (projected.converged()) {
    projection_ = std::move(projected.solution);
    prior_ = projection_.shape;
  }
  return projected;
}

/// The size of the subject: of the markers against their points on the projection, which the markers do not stretch.
void MarkerTracker::updateScale(std::vector<AnchorTarget>& targets, const MarkerPositions& markers) {
  if (options_.scale) return;
  const Vertices points = anchorPositions(submanifold_->calculus().topology(), targets, prior_);
  const auto motion = alignSimilarly(points, wantedPositions(targets), weightsOf(targets));
  if (!(motion.scale > 0.1 && motion.scale < 10)) return;
  scale_ *= motion.scale;
  shape_ /= motion.scale;
  const auto rescaled = targetsOf(markers);
  for (std::size_t l = 0; l < targets.size(); ++l) targets[l].position = rescaled[l].position;
}

Outcome MarkerTracker::firstFrame(std::vector<AnchorTarget>& targets, const MarkerPositions& markers) {
  if (!determinePlacement(targets))
    throw InvalidInput("markers", "the first frame shows fewer than three markers, or only markers on one line");
  place(targets);
  updateScale(targets, markers);
  followRigidly(targets);
  Outcome outcome;
  double last_energy = std::numeric_limits<double>::infinity();
  for (int round = 0; round < options_.first_alternations; ++round) {
    outcome = fitShape(targets);
    if (outcome.termination == Termination::kCancelled) return outcome;
    outcome += projectShape();
    if (!outcome.converged()) return outcome;
    updateScale(targets, markers);
    updateWeights(targets);
    const double energy = shellEnergy(submanifold_->calculus().topology(), shape_, prior_, submanifold_->calculus().bending());
    if (round > 2 && energy > 0.98 * last_energy) break;
    last_energy = energy;
  }
  outcome += fitShape(targets);
  started_ = true;
  return outcome;
}

Outcome MarkerTracker::nextFrame(std::vector<AnchorTarget>& targets) {
  followRigidly(targets);
  updateWeights(targets);
  Outcome outcome = fitShape(targets);
  for (int round = 0; round < options_.alternations && outcome.termination != Termination::kCancelled; ++round) {
    outcome += projectShape();
    updateWeights(targets);
    outcome += fitShape(targets);
  }
  return outcome;
}

Solved<MarkerFit> MarkerTracker::fit(const MarkerPositions& markers) {
  auto targets = targetsOf(markers);
  Outcome outcome;
  bool held = false;
  if (!started_)
    outcome = firstFrame(targets, markers);
  else if (determinePlacement(targets))
    outcome = nextFrame(targets);
  else
    held = true;
  auto result = report(targets);
  result.held = held;
  return {std::move(result), outcome};
}

MarkerFit MarkerTracker::report(const std::vector<AnchorTarget>& targets) const {
  const auto& calculus = submanifold_->calculus();
  MarkerFit result;
  result.residuals.resize(static_cast<Eigen::Index>(targets.size()));
  result.weights = weightsOf(targets);
  const Vertices points = anchorPositions(calculus.topology(), targets, shape_);
  double sum = 0;
  int count = 0;
  for (std::size_t l = 0; l < targets.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    const double distance = scale_ * (points.row(row).transpose() - targets[l].position).norm();
    result.residuals[row] = seen(targets[l]) ? distance : std::nan("");
    if (seen(targets[l])) sum += distance * distance, ++count;
  }
  result.rms = count > 0 ? std::sqrt(sum / count) : std::nan("");
  result.scale = scale_;
  result.point = projection_.point;
  result.prior_energy = shellEnergy(calculus.topology(), shape_, prior_, calculus.bending());
  result.projection = scale_ * apply(alignRigidly(prior_, shape_), prior_);
  result.shape = scale_ * shape_;
  return result;
}

}  // namespace shaped
