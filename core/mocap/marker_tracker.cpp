#include "core/mocap/marker_tracker.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"

namespace shaped {
namespace {

bool seen(const AnchorTarget& target) { return target.weight > 0; }

Eigen::VectorXd weightsOf(const std::vector<AnchorTarget>& targets) {
  Eigen::VectorXd weights(static_cast<Eigen::Index>(targets.size()));
  for (std::size_t l = 0; l < targets.size(); ++l) weights[static_cast<Eigen::Index>(l)] = targets[l].weight;
  return weights;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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

MarkerTracker::MarkerTracker(std::shared_ptr<const Submanifold> submanifold, std::vector<MarkerSite> sites,
                             MarkerTrackerOptions options)
    : submanifold_(std::move(submanifold)), sites_(std::move(sites)), options_(std::move(options)),
      size_(boundingBoxDiagonal(submanifold_->pga().mean)), shape_(submanifold_->pga().mean), prior_(shape_) {
  if (const auto violation = options_.firstViolation()) throw InvalidInput("options", *violation);
  if (sites_.size() < 3)
    throw InvalidInput("marker_set", "has " + std::to_string(sites_.size()) + " markers, a fit needs at least three");
  if (options_.scale) scale_ = *options_.scale;
}

/// The site's offset turned as the patch around it was, from the template to `shape`.
Eigen::Vector3d MarkerTracker::offsetOn(const Vertices& shape, const MarkerSite& site) const {
  if (site.offset.isZero()) return Eigen::Vector3d::Zero();
  Vertices patch(static_cast<Eigen::Index>(site.patch.size()), 3);
  for (std::size_t i = 0; i < site.patch.size(); ++i) patch.row(static_cast<Eigen::Index>(i)) = shape.row(site.patch[i]);
  return alignRigidly(site.patch_template, patch).rotation * site.offset;
}

/// Where the model has the markers on a shape, L x 3.
Vertices MarkerTracker::modelPoints(const Vertices& shape) const {
  Vertices points(static_cast<Eigen::Index>(sites_.size()), 3);
  for (std::size_t l = 0; l < sites_.size(); ++l)
    points.row(static_cast<Eigen::Index>(l)) =
        position(sites_[l].skin, submanifold_->calculus().topology().faces(), shape) + offsetOn(shape, sites_[l]);
  return points;
}

void MarkerTracker::takeMarkers(const MarkerPositions& markers) {
  if (markers.rows() != static_cast<Eigen::Index>(sites_.size()))
    throw InvalidInput("markers", "has " + std::to_string(markers.rows()) + " rows, the marker set has " +
                                      std::to_string(sites_.size()) + " markers");
  targets_.clear();
  markers_ = Vertices::Zero(markers.rows(), 3);
  for (std::size_t l = 0; l < sites_.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    const bool here = markers.row(row).allFinite();
    if (here) markers_.row(row) = markers.row(row) / scale_;
    targets_.push_back({sites_[l].skin, markers_.row(row), here ? 1.0 : 0.0});
  }
}

/// Moves the shape by the rigid motion that brings its marker points to the markers.
void MarkerTracker::followRigidly() { shape_ = apply(alignRigidly(modelPoints(shape_), markers_, weightsOf(targets_)), shape_); }

/// Geman-McClure weights (c^2 / (c^2 + r^2))^2 of the current residuals, c the distance.
void MarkerTracker::updateWeights(double distance) {
  if (options_.robust_scale == 0) return;
  const Vertices points = modelPoints(shape_);
  for (std::size_t l = 0; l < targets_.size(); ++l) {
    if (!seen(targets_[l])) continue;
    const auto row = static_cast<Eigen::Index>(l);
    const double squared = distance * distance;
    const double ratio = squared / (squared + (points.row(row) - markers_.row(row)).squaredNorm());
    // a weight of zero would mean a marker that was not seen
    targets_[l].weight = std::max(ratio * ratio, 1e-12);
  }
}

double MarkerTracker::medianResidual() const {
  const Vertices points = modelPoints(shape_);
  std::vector<double> residuals;
  for (std::size_t l = 0; l < targets_.size(); ++l)
    if (seen(targets_[l]))
      residuals.push_back((points.row(static_cast<Eigen::Index>(l)) - markers_.row(static_cast<Eigen::Index>(l))).norm());
  return median(std::move(residuals));
}

/// For residuals that the pose may still cause.
double MarkerTracker::tolerantDistance() const { return std::max(robustDistance(), 3 * medianResidual()); }

/// Brings the mean to the markers. Reweighted until outliers no longer pull: a single gross one would turn and shrink the
/// model beyond what the rounds that follow could mend.
void MarkerTracker::place(bool estimate_scale) {
  shape_ = prior_ = submanifold_->pga().mean;
  projection_ = {};
  if (estimate_scale && !options_.scale) {
    rescale(neighbourRatio());
    shape_ = prior_;
  }
  for (int round = 0; round < (options_.robust_scale == 0 ? 1 : 20); ++round) {
    followRigidly();
    updateWeights(tolerantDistance());
  }
}

/// Median ratio of the distances between neighbouring markers to those between their points on the shape. Neighbours sit
/// mostly on one part of the body, so neither the pose nor a few outliers change it.
double MarkerTracker::neighbourRatio() const {
  constexpr std::size_t neighbours = 5;
  const Vertices points = modelPoints(shape_);
  std::vector<double> ratios;
  for (std::size_t l = 0; l < targets_.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    std::vector<std::pair<double, double>> distances;  // on the shape, among the markers
    for (std::size_t m = 0; m < targets_.size(); ++m) {
      const auto other = static_cast<Eigen::Index>(m);
      if (m == l || !seen(targets_[l]) || !seen(targets_[m])) continue;
      distances.emplace_back((points.row(row) - points.row(other)).norm(), (markers_.row(row) - markers_.row(other)).norm());
    }
    std::sort(distances.begin(), distances.end());
    for (std::size_t k = 0; k < std::min(neighbours, distances.size()); ++k)
      ratios.push_back(distances[k].second / distances[k].first);
  }
  return median(std::move(ratios));
}

/// The size of the subject: of the markers against their points on the projection, which the markers do not stretch.
void MarkerTracker::updateScale() {
  if (options_.scale) return;
  const auto motion = alignSimilarly(modelPoints(prior_), markers_, weightsOf(targets_));
  if (motion.scale > 0.1 && motion.scale < 10) rescale(motion.scale);
}

void MarkerTracker::rescale(double ratio) {
  scale_ *= ratio;
  shape_ /= ratio;
  markers_ /= ratio;
}

/// min over s for fixed P[s]; offsets keep the direction they have on the shape at hand.
Outcome MarkerTracker::fitShape() {
  for (std::size_t l = 0; l < targets_.size(); ++l)
    targets_[l].position = markers_.row(static_cast<Eigen::Index>(l)).transpose() - offsetOn(shape_, sites_[l]);
  auto fit = fitAnchored(submanifold_->calculus(), prior_, targets_, shape_,
                         {options_.prior_weight, 60, 1e-5, options_.submanifold.stop});
  if (fit.termination != Termination::kNumericalFailure) shape_ = std::move(fit.solution);
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

/// From the mean, placed by the markers: rounds of shape and projection until W[s, P[s]] settles.
Outcome MarkerTracker::alternate(bool estimate_scale) {
  place(estimate_scale);
  Outcome outcome;
  double last_energy = std::numeric_limits<double>::infinity();
  const auto& calculus = submanifold_->calculus();
  for (int round = 0; round < options_.first_alternations; ++round) {
    outcome = fitShape();
    if (outcome.termination == Termination::kCancelled) return outcome;
    outcome += projectShape();
    if (!outcome.converged()) return outcome;
    if (estimate_scale) updateScale();
    updateWeights(tolerantDistance());
    const double energy = shellEnergy(calculus.topology(), shape_, prior_, calculus.bending());
    if (round > 2 && energy > 0.98 * last_energy) break;
    last_energy = energy;
  }
  return outcome += fitShape();
}

Outcome MarkerTracker::firstFrame() {
  for (std::size_t l = 0; l < targets_.size(); ++l) targets_[l].position = markers_.row(static_cast<Eigen::Index>(l));
  if (!determinePlacement(targets_))
    throw InvalidInput("markers", "the first frame shows fewer than three markers, or only markers on one line");
  const Outcome outcome = alternate(true);
  started_ = outcome.converged();
  return outcome;
}

Outcome MarkerTracker::nextFrame() {
  followRigidly();
  // judged by the median before the shape has followed: a fast motion must not look like a frame of outliers
  updateWeights(tolerantDistance());
  followRigidly();
  Outcome outcome = fitShape();
  for (int round = 0; round < options_.alternations && outcome.termination != Termination::kCancelled; ++round) {
    outcome += projectShape();
    updateWeights(robustDistance());
    outcome += fitShape();
  }
  if (outcome.converged() || outcome.termination == Termination::kCancelled) return outcome;
  // the last frame led nowhere: this one starts anew
  for (auto& target : targets_) target.weight = seen(target) ? 1.0 : 0.0;
  Outcome anew = alternate(false);
  anew.iterations += outcome.iterations;
  return anew;
}

Solved<MarkerFit> MarkerTracker::fit(const MarkerPositions& markers) {
  takeMarkers(markers);
  Outcome outcome;
  const bool enough = determinePlacement(targets_);
  if (!started_)
    outcome = firstFrame();
  else if (enough)
    outcome = nextFrame();
  auto result = report();
  result.held = started_ && !enough;
  return {std::move(result), outcome};
}

MarkerFit MarkerTracker::report() const {
  const auto& calculus = submanifold_->calculus();
  MarkerFit result;
  result.weights = weightsOf(targets_);
  result.residuals = scale_ * (modelPoints(shape_) - markers_).rowwise().norm();
  double sum = 0;
  int count = 0;
  for (std::size_t l = 0; l < targets_.size(); ++l) {
    auto& residual = result.residuals[static_cast<Eigen::Index>(l)];
    if (seen(targets_[l]))
      sum += residual * residual, ++count;
    else
      residual = std::nan("");
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
