#include "core/model/body_take_fitter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/body/body_fit.h"
#include "core/io/sealed_tensors.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/model/body_shapes.h"
#include "core/numerics/error.h"
#include "core/registration/scan_to_model.h"

namespace shaped {
namespace {

constexpr const char* kFormat = "body_take_state 1";
constexpr double kMarkerNoise = 0.01;  ///< of skin and marker together, m
constexpr double kStillness = 3e-4;    ///< markers that move less than this from round to round stand still, m
constexpr int kFirstRounds = 30, kNextRounds = 12;

bool seen(const MarkerPositions& markers, Eigen::Index l) { return markers.row(l).allFinite(); }

/// Whether the points determine a placement: three at least, not on one line.
bool spanPlane(const std::vector<Eigen::RowVector3d>& points) {
  if (points.size() < 3) return false;
  double longest = 0, widest = 0;
  for (const auto& point : points) longest = std::max(longest, (point - points[0]).norm());
  for (const auto& one : points)
    for (const auto& other : points)
      widest = std::max(widest, (one - points[0]).cross(Eigen::RowVector3d(other - points[0])).norm());
  return widest > 1e-4 * longest * longest && longest > 0;
}

double median(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

double rmsOf(const Eigen::VectorXd& distances) {
  double sum = 0, count = 0;
  for (const double distance : distances)
    if (std::isfinite(distance)) sum += distance * distance, ++count;
  return count > 0 ? std::sqrt(sum / count) : 0;
}

BodyModel usedModel(const BodyModel& model, int modes) {
  if (modes < 0 || modes > model.modeCount())
    throw InvalidInput("modes",
                       std::to_string(modes) + ", want at most the model's " + std::to_string(model.modeCount()));
  return modes == 0 ? model : model.truncated(modes);
}

void requireOptions(const TakeOptions& options) {
  if (!(options.prior_weight > 0) || !std::isfinite(options.prior_weight))
    throw InvalidInput("prior_weight", "= " + std::to_string(options.prior_weight) + ", want > 0");
  if (!(options.robust_scale >= 0) || !std::isfinite(options.robust_scale))
    throw InvalidInput("robust_scale", "= " + std::to_string(options.robust_scale) + ", want >= 0");
  if (options.scale && *options.scale != 1)
    throw InvalidInput("scale", "= " + std::to_string(*options.scale) +
                                    ", and a model of kind body has its size in its identity: leave it out");
}

}  // namespace

BodyTakeFitter::BodyTakeFitter(std::shared_ptr<const BodyModel> model, const MarkerSet& markers,
                               const TakeOptions& options)
    : whole_(std::move(model)),
      model_(usedModel(*whole_, options.modes)),
      options_(options),
      size_(boundingBoxDiagonal(whole_->parts().mean)) {
  requireOptions(options);
  if (markers.markers.size() < 3)
    throw InvalidInput("marker_set",
                       "has " + std::to_string(markers.markers.size()) + " markers, a fit needs at least three");
  for (std::size_t l = 0; l < markers.markers.size(); ++l)
    sites_.push_back(
        siteOf(model_, markers.markers[l], "markers[" + std::to_string(l) + "] (" + markers.markers[l].label + ")"));
  state_.body = model_.meanState();
}

BodyTakeFitter::Site BodyTakeFitter::siteOf(const BodyModel& model, const MarkerSet::Marker& marker,
                                            const std::string& field) {
  const auto outside = [&](const char* what, std::int32_t index, Eigen::Index count) {
    if (index < 0 || index >= count)
      throw InvalidInput(
          field, std::string(what) + " " + std::to_string(index) + " is outside [0, " + std::to_string(count) + ")");
  };
  if (marker.vertex >= 0) {
    outside("vertex", marker.vertex, model.topology()->vertexCount());
    return {{marker.vertex, marker.vertex, marker.vertex}, Eigen::Vector3d::UnitX(), marker.offset};
  }
  const auto& faces = model.topology()->faces();
  outside("face", marker.face, faces.rows());
  return {{faces(marker.face, 0), faces(marker.face, 1), faces(marker.face, 2)}, marker.barycentric, marker.offset};
}

bool BodyTakeFitter::placeable(const MarkerPositions& markers, const std::string& field) const {
  if (markers.rows() != std::ssize(sites_))
    throw InvalidInput(field, "has " + std::to_string(markers.rows()) + " rows, want one for each of " +
                                  std::to_string(sites_.size()) + " markers");
  std::vector<Eigen::RowVector3d> points;
  for (Eigen::Index l = 0; l < markers.rows(); ++l)
    if (seen(markers, l)) points.emplace_back(markers.row(l));
  return spanPlane(points);
}

BodyTakeFitter::Places BodyTakeFitter::placesOn(const BodyState& body) const {
  const auto skin = model_.posed(body);
  Places places{Vertices(std::ssize(sites_), 3), Vertices(std::ssize(sites_), 3)};
  for (Eigen::Index l = 0; l < places.markers.rows(); ++l) {
    const auto& site = sites_[static_cast<std::size_t>(l)];
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    for (int c = 0; c < 3; ++c) {
      point += site.barycentric[c] * skin.vertices().row(site.corners[static_cast<std::size_t>(c)]).transpose();
      turn += site.barycentric[c] * skin.blend(site.corners[static_cast<std::size_t>(c)]);
    }
    // Blended rotations shorten what they turn.
    const Eigen::Vector3d turned = turn * site.offset;
    const Eigen::Vector3d offset = turned.norm() > 0 ? (turned.normalized() * site.offset.norm()).eval() : turned;
    places.offsets.row(l) = offset;
    places.markers.row(l) = point + offset;
  }
  return places;
}

BodyState BodyTakeFitter::rigidStart(const MarkerPositions& markers) const {
  Eigen::VectorXd present(markers.rows());
  for (Eigen::Index l = 0; l < markers.rows(); ++l) present[l] = seen(markers, l) ? 1 : 0;
  auto start = placedState(model_, alignRigidly(placesOn(model_.meanState()).markers, markers, present));
  if (state_.known) start.identity = state_.body.identity;
  return start;
}

Eigen::VectorXd BodyTakeFitter::distances(const MarkerPositions& markers, const BodyState& body) const {
  const auto places = placesOn(body).markers;
  Eigen::VectorXd result(markers.rows());
  for (Eigen::Index l = 0; l < markers.rows(); ++l)
    result[l] = seen(markers, l) ? (places.row(l) - markers.row(l)).norm() : std::numeric_limits<double>::quiet_NaN();
  return result;
}

/// At least at three times their median distance are markers outliers: the body may have yet to follow them.
Eigen::VectorXd BodyTakeFitter::weights(const Eigen::VectorXd& distances, double least_scale) const {
  std::vector<double> present;
  for (const double distance : distances)
    if (std::isfinite(distance)) present.push_back(distance);
  const double scale = std::max(least_scale, 3 * median(present));
  return distances.unaryExpr([&](double distance) {
    if (!std::isfinite(distance)) return 0.0;
    if (options_.robust_scale == 0 || scale == 0) return 1.0;
    const double share = 1 / (1 + distance * distance / (scale * scale));
    return share * share;
  });
}

/// scale: of the robust loss to begin with, halved from round to round down to the one that is asked for.
Solved<BodyState> BodyTakeFitter::fitFrom(BodyState body, const MarkerPositions& markers, bool identity, int rounds,
                                          double scale) const {
  const double last_scale = options_.robust_scale * size_;
  if (last_scale == 0) scale = 0;
  BodyFitOptions fitting;
  fitting.sigma = kMarkerNoise;
  fitting.prior = options_.prior_weight;
  fitting.identity = identity;
  fitting.stop = options_.stop;
  Outcome outcome;
  Vertices offsets;
  bool still = false;
  for (int round = 0; round < rounds && !options_.stop.stop_requested(); ++round) {
    const auto places = placesOn(body);
    // The mean of what two rounds say: where a bone turns against its marker's offset, full steps would sway for ever.
    offsets = round == 0 ? places.offsets : Vertices(0.5 * (offsets + places.offsets));
    scale = std::max(scale, last_scale);
    const auto weight = weights(distances(markers, body), scale);
    std::vector<SurfaceTarget> targets;
    for (Eigen::Index l = 0; l < markers.rows(); ++l) {
      const auto& site = sites_[static_cast<std::size_t>(l)];
      if (weight[l] > 0)
        targets.push_back({site.corners, site.barycentric, (markers.row(l) - offsets.row(l)).transpose(),
                           Eigen::Vector3d::Zero(), weight[l]});
    }
    fitting.observations = weight.sum();
    auto solved = fitBody(model_, body, targets, fitting);
    const int iterations = outcome.iterations + solved.iterations;
    outcome = solved;
    outcome.iterations = iterations;
    body = std::move(solved.solution);
    const double motion = (placesOn(body).markers - places.markers).rowwise().norm().maxCoeff();
    still = scale <= last_scale && motion < kStillness;
    if (still) break;
    scale /= 2;
  }
  if (!still && outcome.converged()) outcome.termination = Termination::kIterationLimit;
  if (options_.stop.stop_requested()) outcome.termination = Termination::kCancelled;
  return {std::move(body), outcome};
}

Outcome BodyTakeFitter::calibrate(const std::vector<MarkerPositions>& frames) {
  Outcome outcome{Termination::kConverged, 0, 0};
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(model_.modeCount());
  double weights = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string field = "calibration[" + std::to_string(i) + "]";
    if (!placeable(frames[i], field))
      throw InvalidInput(field, "shows fewer than three markers, or only markers on one line");
    const auto solved = fitFrom(rigidStart(frames[i]), frames[i], true, kFirstRounds, size_);
    outcome += solved;
    if (outcome.termination == Termination::kCancelled) return outcome;
    const double rms = std::max(rmsOf(distances(frames[i], solved.solution)), 1e-3);
    sum += solved.solution.identity / (rms * rms);
    weights += 1 / (rms * rms);
  }
  if (weights > 0) {
    state_.body.identity = sum / weights;
    state_.known = true;
  }
  return outcome;
}

Solved<TakeFrame> BodyTakeFitter::fit(const MarkerPositions& markers) {
  const bool enough = placeable(markers, "markers");
  if (!enough && !state_.started)
    throw InvalidInput("markers", "the first frame shows fewer than three markers, or only markers on one line");
  Outcome outcome{Termination::kConverged, 0, 0};
  if (enough) {
    const auto solved = state_.started ? fitFrom(state_.body, markers, false, kNextRounds, 0)
                                       : fitFrom(rigidStart(markers), markers, !state_.known, kFirstRounds, size_);
    outcome = solved;
    state_ = {true, true, solved.solution};
  }
  TakeFrame frame;
  frame.shape = model_.posed(state_.body).vertices();
  frame.point = coefficientsOf(state_.body, whole_->modeCount());
  frame.residuals = distances(markers, state_.body);
  frame.rms = rmsOf(frame.residuals);
  frame.held = !enough;
  frame.smallest_area_ratio = smallestAreaRatio(model_.topology()->faces(), model_.parts().mean, frame.shape);
  return {std::move(frame), outcome};
}

TakeFitter::Keep BodyTakeFitter::state() const {
  return [state = state_](const std::filesystem::path& path, std::int64_t frames) {
    TensorWriter file;
    file.addMatrix("counts", Eigen::Matrix<std::int64_t, 1, 3>(frames, state.started ? 1 : 0, state.known ? 1 : 0));
    file.addMatrix("identity", state.body.identity);
    file.addMatrix("translation", state.body.pose.translation);
    file.addMatrix("rotations", state.body.pose.rotations);
    writeSealed(path, file, kFormat);
  };
}

std::int64_t BodyTakeFitter::resume(const std::filesystem::path& path) {
  const TensorFile file(path);
  requireSealed(file, path, kFormat);
  const auto counts = file.values<std::int64_t>("counts");
  State state{counts[1] != 0, counts[2] != 0, {}};
  state.body.identity = file.matrix<double>("identity", model_.modeCount(), 1);
  state.body.pose.translation = file.matrix<double>("translation", 3, 1);
  state.body.pose.rotations = file.matrix<double>("rotations", model_.skeleton().jointCount(), 3);
  state_ = std::move(state);
  return counts[0];
}

}  // namespace shaped
