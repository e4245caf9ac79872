#include "core/registration/template_fitting.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/fitting_report.h"
#include "core/registration/fitting_step.h"
#include "core/registration/surface_samples.h"

namespace shaped {
namespace {

/// Of a step's linear system; the next step has new correspondences anyway.
constexpr double kAccuracy = 1e-2;

/// What one level does: its place between first and last, in numbers.
struct LevelPlan {
  double stiffness, landmark_weight, coverage_sliding;
  CorrespondenceGates gates;
  RobustLoss loss;
};

double between(double first, double last, double part) { return first * std::pow(last / first, part); }

LevelPlan planLevel(const FittingOptions& options, int level) {
  const double part = options.levels > 1 ? double(level) / (options.levels - 1) : 1;
  LevelPlan plan;
  plan.stiffness = between(options.first_stiffness, options.last_stiffness, part);
  plan.landmark_weight = options.landmark_weight * std::sqrt(plan.stiffness / options.first_stiffness);
  plan.coverage_sliding = part * options.sliding;
  plan.gates = options.gates;
  plan.gates.max_distance = between(options.first_max_distance, options.gates.max_distance, part);
  plan.loss = options.loss;
  plan.loss.scale = between(std::max(options.loss.scale, 0.5 * options.first_max_distance), options.loss.scale, part);
  return plan;
}

/// Twice the largest distance to the mean of the vertices: unlike a box's diagonal it does not change with the
/// placement.
double sizeOf(const Vertices& vertices) {
  const Eigen::RowVector3d mean = vertices.colwise().mean();
  return 2 * (vertices.rowwise() - mean).rowwise().norm().maxCoeff();
}

std::unique_ptr<Deformation> deformationOf(const FittingOptions& options, const Topology& topology,
                                           const Vertices& placed) {
  switch (options.method) {
    case FittingMethod::kDisplacement:
      return freeDisplacement(topology, placed);
    case FittingMethod::kEdgeLengths:
      return keptEdgeLengths(topology, placed);
    case FittingMethod::kAffine:
      break;
  }
  return affineDeformation(topology, placed, options.turn_length * sizeOf(placed));
}

/// Both directions of correspondence.
struct Matches {
  Correspondences onto_scan;                 ///< of every template vertex
  std::vector<std::int32_t> nearest_vertex;  ///< of every coverage point; -1 where the gates leave it out
};

/// One template on its way to one scan.
class Fitting {
 public:
  Fitting(const ScanSurface& scan, const Topology& topology, const Vertices& placed,
          const std::vector<Landmark>& landmarks, const FittingOptions& options, const std::stop_token& stop)
      : scan_(scan),
        topology_(topology),
        landmarks_(landmarks),
        options_(options),
        stop_(stop),
        deformation_(deformationOf(options, topology, placed)),
        shares_(areaShares(topology.faces(), placed)),
        size_(sizeOf(placed)),
        seekers_(options.coverage > 0 ? everyFew(scan.points(), scan.normals(), options.coverage_points)
                                      : SurfaceSamples{}),
        state_(deformation_->start()) {}

  Vertices vertices() const { return deformation_->vertices(state_); }

  double landmarkDistance() const {
    double sum = 0, weight = 0;
    for (const auto& landmark : landmarks_) {
      if (!(landmark.weight > 0)) continue;
      const Eigen::RowVector3d error =
          deformation_->landmark(landmark.anchor).at(state_) - landmark.position.transpose();
      sum += landmark.weight * error.squaredNorm();
      weight += landmark.weight;
    }
    return weight > 0 ? std::sqrt(sum / weight) : 0;
  }

  FittingLevel run(const LevelPlan& plan) {
    FittingLevel level{plan.stiffness, {}, 0, 0};
    FittingSteps steps(*deformation_, plan.stiffness);
    Matches found = matches(plan);
    double energy = energyOf(plan, found), lowest = energy;
    level.energy_at_start = energy;
    level.outcome.termination = Termination::kIterationLimit;
    level.outcome.residual = std::numeric_limits<double>::infinity();
    for (int idle = 0; level.outcome.iterations < options_.steps_per_level;) {
      if (stop_.stop_requested()) return ended(level, Termination::kCancelled, energy);
      if (found.onto_scan.acceptedCount() == 0) return ended(level, Termination::kNumericalFailure, energy);
      const Vertices before = vertices();
      if (!steps.take(pulls(plan, found), kAccuracy, state_, stop_))
        return ended(level, stop_.stop_requested() ? Termination::kCancelled : Termination::kNumericalFailure, energy);
      ++level.outcome.iterations;
      level.outcome.residual = motion(before);
      found = matches(plan);
      energy = energyOf(plan, found);
      if (level.outcome.residual <= options_.tolerance) return ended(level, Termination::kConverged, energy);
      idle = energy < lowest ? 0 : idle + 1;
      lowest = std::min(lowest, energy);
      // New correspondences may raise the energy once (a gate opens); again and again means that they go in circles.
      if (idle == 3) return ended(level, Termination::kStalled, energy);
    }
    return ended(level, Termination::kIterationLimit, energy);
  }

 private:
  static FittingLevel ended(FittingLevel level, Termination termination, double energy) {
    level.outcome.termination = termination;
    level.energy_at_end = energy;
    return level;
  }

  Matches matches(const LevelPlan& plan) const {
    const Vertices shape = vertices(), normals = vertexNormals(topology_.faces(), shape);
    return {findCorrespondences(scan_, shape, normals, plan.gates), nearestVertices(plan.gates, shape, normals)};
  }

  std::vector<std::int32_t> nearestVertices(const CorrespondenceGates& gates, const Vertices& shape,
                                            const Vertices& normals) const {
    std::vector<std::int32_t> nearest(static_cast<std::size_t>(seekers_.points.rows()), -1);
    if (nearest.empty() || !shape.allFinite()) return nearest;
    const PointTree tree(shape);
    for (Eigen::Index s = 0; s < seekers_.points.rows(); ++s) {
      const NearPoint near = tree.nearest(seekers_.points.row(s));
      if (near.squared_distance <= gates.max_distance * gates.max_distance &&
          normalsAgree(gates, scan_.hasOrientedNormals(), seekers_.normals.row(s), normals.row(near.index)))
        nearest[static_cast<std::size_t>(s)] = near.index;
    }
    return nearest;
  }

  Eigen::RowVector3d at(Eigen::Index vertex) const { return state_.row(deformation_->positionRow(vertex)); }

  double seekerSquare(const LevelPlan& plan, Eigen::Index s, std::int32_t vertex) const {
    return slidingSquare(at(vertex) - seekers_.points.row(s), seekers_.normals.row(s), plan.coverage_sliding);
  }

  double seekerWeight() const { return options_.coverage / static_cast<double>(seekers_.points.rows()); }

  double coverageEnergy(const LevelPlan& plan, const Matches& found, double left_out) const {
    double sum = 0;
    for (Eigen::Index s = 0; s < seekers_.points.rows(); ++s) {
      const auto vertex = found.nearest_vertex[static_cast<std::size_t>(s)];
      sum += seekerWeight() * (vertex < 0 ? left_out : plan.loss.value(seekerSquare(plan, s, vertex)));
    }
    return sum;
  }

  /// Adds what pulls vertices to the points that found them: pulls at one vertex add up to one pull.
  void addCoverage(const LevelPlan& plan, const Matches& found, Pulls& pulls) const {
    for (Eigen::Index s = 0; s < seekers_.points.rows(); ++s) {
      const auto vertex = found.nearest_vertex[static_cast<std::size_t>(s)];
      if (vertex < 0) continue;
      const double weight = seekerWeight() * plan.loss.weight(seekerSquare(plan, s, vertex));
      const double total = pulls.weights[vertex] + weight;
      if (!(total > 0)) continue;
      pulls.targets.row(vertex) +=
          weight / total *
          (slidTarget(vertex, seekers_.points.row(s), seekers_.normals.row(s), plan.coverage_sliding) -
           pulls.targets.row(vertex));
      pulls.weights[vertex] = total;
    }
  }

  double squareOf(const Correspondences& found, Eigen::Index v) const {
    return slidingSquare(at(v) - found.targets.row(v), found.normals.row(v), options_.sliding);
  }

  double energyOf(const LevelPlan& plan, const Matches& matched) const {
    const Correspondences& found = matched.onto_scan;
    const double left_out = plan.loss.value(plan.gates.max_distance * plan.gates.max_distance);
    double sum = plan.stiffness * deformation_->energy(state_) + coverageEnergy(plan, matched, left_out);
    for (Eigen::Index v = 0; v < shares_.size(); ++v)
      sum += shares_[v] * (found.accepted[v] > 0 ? plan.loss.value(squareOf(found, v)) : left_out);
    for (const auto& landmark : landmarks_)
      sum += plan.landmark_weight * landmark.weight *
             (deformation_->landmark(landmark.anchor).at(state_) - landmark.position.transpose()).squaredNorm();
    return sum;
  }

  /// r^2 of a vertex x to a point y is bounded by |x - target|^2 with target = x - P (x - y),
  /// P = nn^T + (1 - sliding) (1 - nn^T), which has no eigenvalue above 1.
  Eigen::RowVector3d slidTarget(Eigen::Index vertex, const Eigen::RowVector3d& point, const Eigen::RowVector3d& normal,
                                double sliding) const {
    const Eigen::RowVector3d off = at(vertex) - point;
    if (normal.squaredNorm() == 0) return point;
    return at(vertex) - (1 - sliding) * off - sliding * off.dot(normal) * normal;
  }

  Pulls pulls(const LevelPlan& plan, const Matches& matched) const {
    const Correspondences& found = matched.onto_scan;
    Pulls pulls{Vertices(shares_.size(), 3), Eigen::VectorXd(shares_.size()), {}};
    for (Eigen::Index v = 0; v < shares_.size(); ++v) {
      pulls.targets.row(v) = slidTarget(v, found.targets.row(v), found.normals.row(v), options_.sliding);
      pulls.weights[v] = shares_[v] * found.accepted[v] * plan.loss.weight(squareOf(found, v));
    }
    addCoverage(plan, matched, pulls);
    for (const auto& landmark : landmarks_)
      if (landmark.weight > 0)
        pulls.landmarks.push_back({deformation_->landmark(landmark.anchor), landmark.position.transpose(),
                                   plan.landmark_weight * landmark.weight});
    return pulls;
  }

  /// Root mean square motion over the area, relative to the size.
  double motion(const Vertices& before) const {
    const Eigen::VectorXd squares = (vertices() - before).rowwise().squaredNorm();
    return std::sqrt(squares.dot(shares_)) / size_;
  }

  const ScanSurface& scan_;
  const Topology& topology_;
  const std::vector<Landmark>& landmarks_;
  const FittingOptions& options_;
  const std::stop_token& stop_;
  std::unique_ptr<Deformation> deformation_;
  Eigen::VectorXd shares_;
  double size_;
  SurfaceSamples seekers_;  ///< points of the scan that look for the template
  Eigen::MatrixXd state_;
};

void requireLandmarks(const std::vector<Landmark>& landmarks, const Faces& faces) {
  for (std::size_t l = 0; l < landmarks.size(); ++l) {
    const std::string field = "landmarks[" + std::to_string(l) + "]";
    const auto& landmark = landmarks[l];
    if (landmark.anchor.face < 0 || landmark.anchor.face >= faces.rows())
      throw InvalidInput(field, "lies on face " + std::to_string(landmark.anchor.face) + ", outside [0, " +
                                    std::to_string(faces.rows()) + ")");
    if (!landmark.position.allFinite()) throw InvalidInput(field, "has a position that is not finite");
    if (!(landmark.weight >= 0) || !std::isfinite(landmark.weight))
      throw InvalidInput(field, "has weight " + std::to_string(landmark.weight) + ", want a finite number >= 0");
  }
}

std::string text(const char* field, double value, const char* wanted) {
  return std::string(field) + " = " + std::to_string(value) + ", want " + wanted;
}

}  // namespace

std::optional<std::string> FittingOptions::firstViolation() const {
  if (!(first_stiffness > 0)) return text("first_stiffness", first_stiffness, "> 0");
  if (!(last_stiffness > 0 && last_stiffness <= first_stiffness))
    return text("last_stiffness", last_stiffness, "(0, first_stiffness]");
  if (levels < 1) return "levels = " + std::to_string(levels) + ", want >= 1";
  if (!(turn_length > 0)) return text("turn_length", turn_length, "> 0");
  if (const auto violation = gates.firstViolation()) return "gates." + *violation;
  if (!(first_max_distance >= gates.max_distance))
    return text("first_max_distance", first_max_distance, ">= gates.max_distance");
  if (!(loss.scale > 0)) return text("loss.scale", loss.scale, "> 0");
  if (!(sliding >= 0 && sliding <= 1)) return text("sliding", sliding, "[0, 1]");
  if (!(coverage >= 0)) return text("coverage", coverage, ">= 0");
  if (coverage_points < 1) return "coverage_points = " + std::to_string(coverage_points) + ", want >= 1";
  if (!(landmark_weight >= 0)) return text("landmark_weight", landmark_weight, ">= 0");
  if (steps_per_level < 1) return "steps_per_level = " + std::to_string(steps_per_level) + ", want >= 1";
  if (!(tolerance > 0)) return text("tolerance", tolerance, "> 0");
  return std::nullopt;
}

Solved<FittedTemplate> fitTemplate(const ScanSurface& scan, const Topology& topology, const Vertices& placed,
                                   const std::vector<Landmark>& landmarks, const FittingOptions& options,
                                   const std::stop_token& stop) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("fitting options", *violation);
  requireValidShape(topology, placed, "placed");
  requireLandmarks(landmarks, topology.faces());
  Fitting fitting(scan, topology, placed, landmarks, options, stop);
  Solved<FittedTemplate> fitted;
  for (int level = 0; level < options.levels; ++level) {
    fitted.solution.levels.push_back(fitting.run(planLevel(options, level)));
    const auto& outcome = fitted.solution.levels.back().outcome;
    fitted.termination = outcome.termination;
    fitted.iterations += outcome.iterations;
    fitted.residual = outcome.residual;
    if (outcome.termination == Termination::kCancelled || outcome.termination == Termination::kNumericalFailure) break;
  }
  fitted.solution.vertices = fitted.termination == Termination::kNumericalFailure ? placed : fitting.vertices();
  fitted.solution.report = reportFit(scan, topology, placed, fitted.solution.vertices, options.gates);
  fitted.solution.report.landmark_distance = fitting.landmarkDistance();
  return fitted;
}

}  // namespace shaped
