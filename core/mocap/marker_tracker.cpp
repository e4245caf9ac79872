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
    : submanifold_(std::move(submanifold)),
      sites_(std::move(sites)),
      options_(std::move(options)),
      size_(boundingBoxDiagonal(submanifold_->pga().mean)) {
  state_.shape = state_.prior = submanifold_->pga().mean;
  if (const auto violation = options_.firstViolation()) throw InvalidInput("options", *violation);
  if (sites_.size() < 3)
    throw InvalidInput("marker_set", "has " + std::to_string(sites_.size()) + " markers, a fit needs at least three");
  if (options_.scale) state_.scale = *options_.scale;
}

/// The site's offset turned as the patch around it was, from the template to `shape`.
Eigen::Vector3d MarkerTracker::offsetOn(const Vertices& shape, const MarkerSite& site) const {
  if (site.offset.isZero()) return Eigen::Vector3d::Zero();
  Vertices patch(static_cast<Eigen::Index>(site.patch.size()), 3);
  for (std::size_t i = 0; i < site.patch.size(); ++i)
    patch.row(static_cast<Eigen::Index>(i)) = shape.row(site.patch[i]);
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

void MarkerTracker::takeMarkers(const MarkerPositions& markers, const std::string& field) {
  if (markers.rows() != static_cast<Eigen::Index>(sites_.size()))
    throw InvalidInput(field, "has " + std::to_string(markers.rows()) + " rows, the marker set has " +
                                  std::to_string(sites_.size()) + " markers");
  state_.targets.clear();
  state_.markers = Vertices::Zero(markers.rows(), 3);
  for (std::size_t l = 0; l < sites_.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    const bool here = markers.row(row).allFinite();
    if (here) state_.markers.row(row) = markers.row(row) / state_.scale;
    state_.targets.push_back({sites_[l].skin, state_.markers.row(row), here ? 1.0 : 0.0});
  }
}

/// Moves the shape by the rigid motion that brings its marker points to the markers.
void MarkerTracker::followRigidly() {
  state_.shape =
      apply(alignRigidly(modelPoints(state_.shape), state_.markers, weightsOf(state_.targets)), state_.shape);
}

/// Geman-McClure weights (c^2 / (c^2 + r^2))^2 of the current residuals, c the distance.
void MarkerTracker::updateWeights(double distance) {
  if (options_.robust_scale == 0) return;
  const Vertices points = modelPoints(state_.shape);
  for (std::size_t l = 0; l < state_.targets.size(); ++l) {
    if (!seen(state_.targets[l])) continue;
    const auto row = static_cast<Eigen::Index>(l);
    const double squared = distance * distance;
    const double ratio = squared / (squared + (points.row(row) - state_.markers.row(row)).squaredNorm());
    // a weight of zero would mean a marker that was not seen
    state_.targets[l].weight = std::max(ratio * ratio, 1e-12);
  }
}

double MarkerTracker::medianResidual() const {
  const Vertices points = modelPoints(state_.shape);
  std::vector<double> residuals;
  for (std::size_t l = 0; l < state_.targets.size(); ++l)
    if (seen(state_.targets[l]))
      residuals.push_back(
          (points.row(static_cast<Eigen::Index>(l)) - state_.markers.row(static_cast<Eigen::Index>(l))).norm());
  return median(std::move(residuals));
}

/// For residuals that the pose may still cause.
double MarkerTracker::tolerantDistance() const { return std::max(robustDistance(), 3 * medianResidual()); }

/// Brings the mean to the markers. Reweighted until outliers no longer pull: a single gross one would turn and shrink
/// the model beyond what the rounds that follow could mend.
void MarkerTracker::place(bool estimate_scale) {
  state_.shape = state_.prior = submanifold_->pga().mean;
  state_.projection = {};
  if (estimate_scale && !options_.scale) {
    rescale(neighbourRatio());
    state_.shape = state_.prior;
  }
  for (int round = 0; round < (options_.robust_scale == 0 ? 1 : 20); ++round) {
    followRigidly();
    updateWeights(tolerantDistance());
  }
}

/// Median ratio of the distances between neighbouring markers to those between their points on the shape. Neighbours
/// sit mostly on one part of the body, so neither the pose nor a few outliers change it.
double MarkerTracker::neighbourRatio() const {
  constexpr std::size_t neighbours = 5;
  const Vertices points = modelPoints(state_.shape);
  std::vector<double> ratios;
  for (std::size_t l = 0; l < state_.targets.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    std::vector<std::pair<double, double>> distances;  // on the shape, among the markers
    for (std::size_t m = 0; m < state_.targets.size(); ++m) {
      const auto other = static_cast<Eigen::Index>(m);
      if (m == l || !seen(state_.targets[l]) || !seen(state_.targets[m])) continue;
      distances.emplace_back((points.row(row) - points.row(other)).norm(),
                             (state_.markers.row(row) - state_.markers.row(other)).norm());
    }
    std::sort(distances.begin(), distances.end());
    for (std::size_t k = 0; k < std::min(neighbours, distances.size()); ++k)
      if (distances[k].first > 0) ratios.push_back(distances[k].second / distances[k].first);
  }
  return ratios.empty() ? 1 : median(std::move(ratios));
}

/// The size of the subject: of the markers against their points on the projection, which the markers do not stretch.
void MarkerTracker::updateScale() {
  if (options_.scale) return;
  const auto motion = alignSimilarly(modelPoints(state_.prior), state_.markers, weightsOf(state_.targets));
  if (motion.scale > 0.1 && motion.scale < 10) rescale(motion.scale);
}

void MarkerTracker::rescale(double ratio) {
  state_.scale *= ratio;
  state_.shape /= ratio;
  state_.markers /= ratio;
}

/// min over s for fixed P[s]; offsets keep the direction they have on the shape at hand.
Outcome MarkerTracker::fitShape() {
  for (std::size_t l = 0; l < state_.targets.size(); ++l)
    state_.targets[l].position =
        state_.markers.row(static_cast<Eigen::Index>(l)).transpose() - offsetOn(state_.shape, sites_[l]);
  auto fit = fitAnchored(submanifold_->calculus(), state_.prior, state_.targets, state_.shape,
                         {options_.prior_weight, 60, 1e-5, options_.submanifold.stop});
  if (fit.termination != Termination::kNumericalFailure) state_.shape = std::move(fit.solution);
  return fit;
}

Outcome MarkerTracker::projectShape() {
  auto projected = submanifold_->project(state_.shape, options_.submanifold,
                                         state_.projection.geodesic.empty() ? nullptr : &state_.projection);
  if (projected.converged()) {
    state_.projection = std::move(projected.solution);
    state_.prior = state_.projection.shape;
  }
  return projected;
}

/// What the alternation lowers: the robust form of (22), c^2 r^2 / (c^2 + r^2) summed over the markers plus the prior's
/// energy. It falls too when c shrinks.
double MarkerTracker::robustEnergy(double distance) const {
  const Vertices points = modelPoints(state_.shape);
  double sum = 0;
  for (std::size_t l = 0; l < state_.targets.size(); ++l) {
    if (!seen(state_.targets[l])) continue;
    const auto row = static_cast<Eigen::Index>(l);
    const double squared = (points.row(row) - state_.markers.row(row)).squaredNorm();
    sum += options_.robust_scale == 0 ? squared : squared * distance * distance / (distance * distance + squared);
  }
  const auto& calculus = submanifold_->calculus();
  return sum + options_.prior_weight * shellEnergy(calculus.topology(), state_.shape, state_.prior, calculus.bending());
}

/// One round: shape, projection, size and weights.
Outcome MarkerTracker::round(bool estimate_scale) {
  Outcome outcome = fitShape();
  if (outcome.termination == Termination::kCancelled) return outcome;
  outcome += projectShape();
  if (!outcome.converged()) return outcome;
  if (estimate_scale) updateScale();
  updateWeights(tolerantDistance());
  state_.energy = robustEnergy(tolerantDistance());
  return outcome;
}

/// Moves the prior and the size to where the rounds seem to go; false where there is nothing to tell or no such shape.
bool MarkerTracker::lookAhead(const ProjectionAccelerator& accelerator, ProjectionAccelerator::State& start) {
  const auto proposed = accelerator.propose();
  if (!proposed) return false;
  auto ahead = submanifold_->shapeOf(proposed->point, options_.submanifold, &state_.projection.local);
  if (!ahead.converged()) return false;
  state_.prior = std::move(ahead.solution.shape);
  if (!options_.scale) rescale(std::exp(proposed->extra / size_) / state_.scale);
  start = *proposed;
  return true;
}

/// From the mean, placed by the markers: rounds of shape and projection, accelerated, until their energy settles; or,
/// after some, while it is above `hopeless_energy`.
Outcome MarkerTracker::alternate(bool estimate_scale, double hopeless_energy) {
  place(estimate_scale);
  ProjectionAccelerator accelerator(*submanifold_);
  const auto state = [&] {
    return ProjectionAccelerator::State{state_.projection.point, size_ * std::log(state_.scale)};
  };
  state_.projection.point = submanifold_->pointOf(Eigen::VectorXd::Zero(submanifold_->pga().modes()));
  Outcome total;
  auto last = state_;
  last.energy = std::numeric_limits<double>::infinity();
  int small_falls = 0;  // in a row
  for (int count = 0; count < options_.first_alternations && small_falls < 2; ++count) {
    auto start = state();
    const bool ahead = lookAhead(accelerator, start);
    const auto done = round(estimate_scale);
    total.iterations += done.iterations;
    const bool better = done.converged() && state_.energy < last.energy;
    if (ahead && !better && done.termination != Termination::kCancelled) {
      accelerator.forget();  // it led astray: back to plain rounds from the last state
      state_ = last;
      continue;
    }
    if (!done.converged()) return {done.termination, total.iterations, done.residual};
    if (count >= 8 && state_.energy > hopeless_energy) break;
    small_falls = last.energy - state_.energy <= 0.01 * state_.energy ? small_falls + 1 : 0;
    accelerator.add(start, state());
    last = state_;
  }
  total += fitShape();
  return total;
}

/// Do the markers seen determine where the shape stands?
bool MarkerTracker::placeable() {
  for (std::size_t l = 0; l < state_.targets.size(); ++l)
    state_.targets[l].position = state_.markers.row(static_cast<Eigen::Index>(l));
  return determinePlacement(state_.targets);
}

Outcome MarkerTracker::calibrate(const std::vector<MarkerPositions>& frames) {
  Outcome outcome;
  if (frames.empty() || options_.scale) return outcome;
  double sum = 0, weights = 0, least_energy = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string field = "calibration[" + std::to_string(i) + "]";
    state_.scale = 1;
    takeMarkers(frames[i], field);
    if (!placeable()) throw InvalidInput(field, "shows fewer than three markers, or only markers on one line");
    // a frame that ends with three times the energy of another counts a ninth of it: no need to finish it
    const auto aligned = alternate(true, 3 * least_energy);
    outcome.iterations += aligned.iterations;
    outcome.termination = aligned.termination;
    if (aligned.termination == Termination::kCancelled) break;
    if (!aligned.converged()) continue;
    least_energy = std::min(least_energy, state_.energy);
    const double misfit = std::max(state_.energy, 1e-12 * size_ * size_), weight = 1 / (misfit * misfit);
    sum += weight * std::log(state_.scale);
    weights += weight;
  }
  state_.scale = 1;
  if (weights == 0) return outcome;
  options_.scale = state_.scale = std::exp(sum / weights);
  if (outcome.termination != Termination::kCancelled) outcome.termination = Termination::kConverged;
  return outcome;
}

Outcome MarkerTracker::firstFrame() {
  if (!placeable())
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
  for (auto& target : state_.targets) target.weight = seen(target) ? 1.0 : 0.0;
  Outcome anew = alternate(false);
  anew.iterations += outcome.iterations;
  return anew;
}

Solved<MarkerFit> MarkerTracker::fit(const MarkerPositions& markers) {
  takeMarkers(markers, "markers");
  Outcome outcome;
  const bool enough = placeable();
  if (!started_)
    outcome = firstFrame();
  else if (enough)
    outcome = nextFrame();
  auto result = report();
  result.held = started_ && !enough;
  return {std::move(result), outcome};
}

MarkerTrackerState MarkerTracker::state() const {
  return {started_, options_.scale, state_.scale, state_.shape, state_.prior, state_.projection};
}

void MarkerTracker::resume(MarkerTrackerState state) {
  const auto vertices = submanifold_->pga().mean.rows();
  if (state.shape.rows() != vertices || state.prior.rows() != vertices)
    throw InvalidInput("state", "is of a mesh with another vertex count than the model's");
  started_ = state.started;
  options_.scale = state.calibrated;
  state_ = {};
  state_.scale = state.scale;
  state_.shape = std::move(state.shape);
  state_.prior = std::move(state.prior);
  state_.projection = std::move(state.projection);
}

MarkerFit MarkerTracker::report() const {
  const auto& calculus = submanifold_->calculus();
  MarkerFit result;
  result.weights = weightsOf(state_.targets);
  result.residuals = state_.scale * (modelPoints(state_.shape) - state_.markers).rowwise().norm();
  double sum = 0;
  int count = 0;
  for (std::size_t l = 0; l < state_.targets.size(); ++l) {
    auto& residual = result.residuals[static_cast<Eigen::Index>(l)];
    if (seen(state_.targets[l]))
      sum += residual * residual, ++count;
    else
      residual = std::nan("");
  }
  result.rms = count > 0 ? std::sqrt(sum / count) : std::nan("");
  result.scale = state_.scale;
  result.point = state_.projection.point;
  result.prior_energy = shellEnergy(calculus.topology(), state_.shape, state_.prior, calculus.bending());
  result.projection = state_.scale * apply(alignRigidly(state_.prior, state_.shape), state_.prior);
  result.shape = state_.scale * state_.shape;
  return result;
}

}  // namespace shaped
