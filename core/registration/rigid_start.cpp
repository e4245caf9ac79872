#include "core/registration/rigid_start.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "core/numerics/error.h"
#include "core/registration/icp.h"
#include "core/registration/rotation_cover.h"

namespace shaped {
namespace {

constexpr int kDenseSamples = 4000, kCoarseSamples = 1000;

/// Centre, spread and right-handed principal axes of a point set.
struct Frame {
  Eigen::RowVector3d centre;
  double radius;         ///< root mean square distance to the centre, m
  Eigen::Matrix3d axes;  ///< columns, by increasing spread
};

Frame frameOf(const Vertices& points) {
  Frame frame;
  frame.centre = points.colwise().mean();
  const Vertices centred = points.rowwise() - frame.centre;
  frame.radius = std::sqrt(centred.squaredNorm() / static_cast<double>(points.rows()));
  frame.axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(centred.transpose() * centred).eigenvectors();
  if (frame.axes.determinant() < 0) frame.axes.col(0) *= -1;
  return frame;
}

struct Candidate {
  SimilarityMotion placement;
  double score = std::numeric_limits<double>::infinity();
  int steps = 0;
  double last_step = std::numeric_limits<double>::infinity();
};

bool byScore(const Candidate& one, const Candidate& other) { return one.score < other.score; }

/// How far a step went: the angle, or the lengths relative to the template's radius, whichever is larger.
double stepSize(const SimilarityMotion& from, const SimilarityMotion& to, double radius) {
  return std::max({angleBetween(from.rotation, to.rotation), std::abs(std::log(to.scale / from.scale)),
                   (from.translation - to.translation).norm() / (to.scale * radius)});
}

/// All candidates that are not within `angle` [rad] of a better one, best first.
std::vector<Candidate> distinct(std::vector<Candidate> candidates, double angle) {
  std::stable_sort(candidates.begin(), candidates.end(), byScore);
  std::vector<Candidate> kept;
  for (const auto& candidate : candidates)
    if (std::none_of(kept.begin(), kept.end(), [&](const Candidate& better) {
          return angleBetween(better.placement.rotation, candidate.placement.rotation) < angle;
        }))
      kept.push_back(candidate);
  return kept;
}

SurfaceSamples scanSamples(const ScanSurface& scan, int count) {
  return everyFew(scan.points(), scan.normals(), count);
}

/// One search over all placements of a template whose samples lie about the origin.
class PlacementSearch {
 public:
  PlacementSearch(const ScanSurface& scan, const SurfaceSamples& centred, const RigidStartOptions& options,
                  const std::stop_token& stop)
      : options_(options),
        stop_(stop),
        model_frame_(frameOf(centred.points)),
        scan_frame_(frameOf(scan.points())),
        model_(centred, everyFew(centred.points, centred.normals, options.samples)),
        scan_(scanSamples(scan, kDenseSamples), scanSamples(scan, options.samples)),
        coarse_model_(everyFew(centred.points, centred.normals, kCoarseSamples),
                      everyFew(centred.points, centred.normals, options.samples / 3)),
        coarse_scan_(scanSamples(scan, kCoarseSamples), scanSamples(scan, options.samples / 3)),
        icp_options_{options.scan_share, options.template_share, options.largest_scale, scan.hasOrientedNormals()} {}

  /// Distinct placements, best first, at least one.
  std::vector<Candidate> run() {
    const Icp coarse(coarse_model_, coarse_scan_, icp_options_), fine(model_, scan_, icp_options_);
    std::vector<Candidate> candidates;
    for (const auto& turn : icosahedralRotations())
      candidates.push_back(descend(coarse, start(turn), options_.coarse_steps, true));
    candidates = best(candidates, 4 * options_.kept);
    for (auto& candidate : candidates) candidate = descend(coarse, candidate, 2 * options_.coarse_steps, false);
    candidates = best(candidates, options_.kept);
    for (auto& candidate : candidates) candidate = descend(fine, candidate, options_.fine_steps, false);
    candidates = best(candidates, options_.kept);
    // What the scan shows of the template is known only now: from here on all of it counts.
    icp_options_.template_share =
        std::clamp(fine.pair(candidates.front().placement).overlap, options_.template_share, 0.95);
    const Icp whole(model_, scan_, icp_options_);
    for (auto& candidate : candidates) candidate = descend(whole, candidate, options_.fine_steps, false);
    return best(candidates, options_.kept);
  }

  /// The rigid motion with the placement's rotation that brings the paired points together best.
  RigidMotion withoutScale(const SimilarityMotion& placement) const {
    const IcpPairs pairs = Icp(model_, scan_, icp_options_).pair(placement);
    const Eigen::Vector3d between =
        (pairs.scan.transpose() - placement.rotation * pairs.model.transpose()) * pairs.weights;
    return {placement.rotation, between / pairs.weights.sum()};
  }

 private:
  std::vector<Candidate> best(const std::vector<Candidate>& candidates, int count) const {
    auto kept = distinct(candidates, options_.distinct_angle * std::numbers::pi / 180);
    kept.resize(std::min(kept.size(), static_cast<std::size_t>(count)));
    return kept;
  }

  Candidate start(const Eigen::Matrix3d& turn) const {
    Candidate candidate;
    candidate.placement.rotation = scan_frame_.axes * turn * model_frame_.axes.transpose();
    candidate.placement.scale =
        std::clamp(scan_frame_.radius / model_frame_.radius, 1 / options_.largest_scale, options_.largest_scale);
    candidate.placement.translation = scan_frame_.centre.transpose();
    return candidate;
  }

  Candidate descend(const Icp& icp, Candidate candidate, int steps, bool to_points) const {
    candidate.last_step = std::numeric_limits<double>::infinity();
    for (int step = 0; step < steps && !stop_.stop_requested(); ++step, ++candidate.steps) {
      const IcpPairs pairs = icp.pair(candidate.placement);
      const SimilarityMotion next = to_points ? icp.stepToPoints(pairs) : icp.stepToPlanes(pairs, candidate.placement);
      candidate.last_step = stepSize(candidate.placement, next, model_frame_.radius);
      candidate.placement = next;
      if (candidate.last_step <= options_.tolerance) break;
    }
    candidate.score = icp.pair(candidate.placement).score;
    return candidate;
  }

  const RigidStartOptions& options_;
  const std::stop_token& stop_;
  Frame model_frame_, scan_frame_;
  SampledSurface model_, scan_, coarse_model_, coarse_scan_;
  IcpOptions icp_options_;
};

/// The motion of a template before its points were moved by -centre.
template <class Motion>
Motion aboutOrigin(Motion motion, const Eigen::Matrix3d& linear, const Eigen::RowVector3d& centre) {
  motion.translation -= linear * centre.transpose();
  return motion;
}

/// Landmarks of positive weight, on the template and on the scan.
struct LandmarkPairs {
  Vertices model, scan;  ///< n x 3
  Eigen::VectorXd weights;
};

LandmarkPairs pairsOf(const std::vector<Landmark>& landmarks, const Vertices& vertices, const Faces& faces) {
  std::vector<Landmark> counting;
  std::copy_if(landmarks.begin(), landmarks.end(), std::back_inserter(counting),
               [](const Landmark& landmark) { return landmark.weight > 0; });
  const auto count = static_cast<Eigen::Index>(counting.size());
  if (count < 3)
    throw InvalidInput("landmarks",
                       std::to_string(count) + " have a weight above 0, want at least 3 to place a template");
  LandmarkPairs pairs{Vertices(count, 3), Vertices(count, 3), Eigen::VectorXd(count)};
  for (Eigen::Index l = 0; l < count; ++l) {
    const Landmark& landmark = counting[static_cast<std::size_t>(l)];
    pairs.model.row(l) = position(landmark.anchor, faces, vertices).transpose();
    pairs.scan.row(l) = landmark.position.transpose();
    pairs.weights[l] = landmark.weight;
  }
  return pairs;
}

void requireSpannedPlane(const Vertices& points, const std::string& field) {
  const Vertices centred = points.rowwise() - points.colwise().mean();
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(centred.transpose() * centred, Eigen::EigenvaluesOnly)
          .eigenvalues();
  if (!(spread[1] > 1e-6 * spread[2])) throw InvalidInput(field, "lie on one line and leave turns about it open");
}

Outcome outcomeOf(const Candidate& best, double tolerance, const std::stop_token& stop) {
  const auto termination = stop.stop_requested()         ? Termination::kCancelled
                           : best.last_step <= tolerance ? Termination::kConverged
                                                         : Termination::kIterationLimit;
  return {termination, best.steps, best.last_step};
}

}  // namespace

std::optional<std::string> RigidStartOptions::firstViolation() const {
  if (samples < 50) return "samples = " + std::to_string(samples) + ", want >= 50";
  if (coarse_steps < 1) return "coarse_steps = " + std::to_string(coarse_steps) + ", want >= 1";
  if (fine_steps < 1) return "fine_steps = " + std::to_string(fine_steps) + ", want >= 1";
  if (kept < 1) return "kept = " + std::to_string(kept) + ", want >= 1";
  if (!(tolerance > 0)) return "tolerance = " + std::to_string(tolerance) + ", want > 0";
  if (!(scan_share > 0 && scan_share <= 1)) return "scan_share = " + std::to_string(scan_share) + ", want (0, 1]";
  if (!(template_share > 0 && template_share <= 1))
    return "template_share = " + std::to_string(template_share) + ", want (0, 1]";
  if (!(largest_scale >= 1)) return "largest_scale = " + std::to_string(largest_scale) + ", want >= 1";
  if (!(distinct_angle > 0 && distinct_angle <= 180))
    return "distinct_angle = " + std::to_string(distinct_angle) + ", want (0, 180] degrees";
  return std::nullopt;
}

Solved<RigidStart> startRigidly(const ScanSurface& scan, const Vertices& template_vertices, const Faces& template_faces,
                                const RigidStartOptions& options, const std::stop_token& stop) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("rigid start options", *violation);
  SurfaceSamples samples = sampleByArea(template_faces, template_vertices, kDenseSamples);
  const Eigen::RowVector3d centre = samples.points.colwise().mean();
  samples.points.rowwise() -= centre;
  PlacementSearch search(scan, samples, options, stop);
  const auto found = search.run();
  const Candidate& best = found.front();
  RigidStart start;
  start.similarity = aboutOrigin(best.placement, best.placement.scale * best.placement.rotation, centre);
  start.motion = aboutOrigin(search.withoutScale(best.placement), best.placement.rotation, centre);
  start.score = best.score;
  start.margin = std::numeric_limits<double>::infinity();
  if (found.size() > 1) {
    start.runner_up = aboutOrigin(search.withoutScale(found[1].placement), found[1].placement.rotation, centre);
    start.margin = (found[1].score - best.score) / best.score;
  }
  return {start, outcomeOf(best, options.tolerance, stop)};
}

Solved<RigidStart> startFromLandmarks(const std::vector<Landmark>& landmarks, const Vertices& template_vertices,
                                      const Faces& template_faces) {
  const LandmarkPairs pairs = pairsOf(landmarks, template_vertices, template_faces);
  requireSpannedPlane(pairs.model, "landmarks' anchors");
  requireSpannedPlane(pairs.scan, "landmarks' positions");
  RigidStart start;
  start.motion = alignRigidly(pairs.model, pairs.scan, pairs.weights);
  start.similarity = alignSimilarly(pairs.model, pairs.scan, pairs.weights);
  const Eigen::VectorXd squares = (apply(start.motion, pairs.model) - pairs.scan).rowwise().squaredNorm();
  start.score = std::sqrt(squares.dot(pairs.weights) / pairs.weights.sum());
  start.margin = std::numeric_limits<double>::infinity();
  return {start, Outcome{}};
}

}  // namespace shaped
