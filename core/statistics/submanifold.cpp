#include "core/statistics/submanifold.h"

#include <cmath>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/numerics/simplex_qp.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

GeodesicOptions geodesicOptions(const SubmanifoldOptions& options) {
  return {100, options.shape_tolerance, options.stop};
}

/// W,2[undeformed, deformed] with the pinned unknowns cleared.
Eigen::VectorXd secondForce(const GeodesicCalculus& calculus, const ShellMeasures& undeformed, const Vertices& deformed,
                            const ShellMeasures& deformed_measures, const Pins& pins) {
  MeasureGradient gradient(calculus.topology());
  addSecondGradient(calculus.topology(), undeformed, deformed_measures, calculus.bending(), 1, gradient);
  Vertices force = Vertices::Zero(deformed.rows(), 3);
  pullBackGradient(calculus.topology(), deformed, gradient, force);
  Eigen::VectorXd result = flatten(force);
  pins.clear(result.data());
  return result;
}

}  // namespace

Submanifold::Submanifold(std::shared_ptr<const GeodesicCalculus> calculus, std::shared_ptr<const ShellPga> pga,
                         Refine refine)
    : calculus_(std::move(calculus)),
      pga_(std::move(pga)),
      refine_(std::move(refine)),
      mean_measures_(measure(calculus_->topology(), pga_->mean)),
      force_floor_(forceFloor(calculus_->topology(), pga_->mean, mean_measures_, calculus_->bending())),
      derived_(std::make_unique<Derived[]>(pga_->variations.size())) {}

Vertices Submanifold::variation(std::size_t j) const {
  const Vertices shape = pga_->variations[j];
  return refine_ ? refine_(shape) : shape;
}

void Submanifold::derive(std::size_t j, Derived& result) const {
  result.measures = measure(calculus_->topology(), variation(j));
  result.force =
      secondForce(*calculus_, result.measures, pga_->mean, mean_measures_, gaugePins(pga_->mean)).norm() + force_floor_;
  if (j < static_cast<std::size_t>(pga_->modes()))
    result.distance =
        std::sqrt(std::max(calculus_->energy().value(calculus_->topology(), mean_measures_, result.measures), 0.0));
  result.done = true;
}

const Submanifold::Derived& Submanifold::derived(std::size_t j) const {
  auto& result = derived_[j];
  std::call_once(result.once, [&] { derive(j, result); });
  return result;
}

bool Submanifold::prepare(const std::vector<std::size_t>& vertices, const std::stop_token& stop) const {
  for (const auto j : vertices) {
    if (stop.stop_requested()) return false;
    derived(j);
  }
  return true;
}

std::size_t Submanifold::derivedVariations() const {
  std::size_t count = 0;
  for (std::size_t j = 0; j < pga_->variations.size(); ++j) count += derived_[j].done ? 1 : 0;
  return count;
}

std::size_t Submanifold::bytes() const {
  const auto& topology = calculus_->topology();
  const auto numbers = topology.edges().size() + static_cast<std::size_t>(topology.faces().rows()) +
                       topology.hinges().size();  // of one shape's measures
  const auto variations = pga_->variations.size();
  return sizeof(double) * numbers * (variations + 1) + sizeof(Derived) * variations;
}

double Submanifold::nearestVariation(std::size_t modes) const {
  double nearest = distance(0);
  for (std::size_t j = 1; j < modes; ++j) nearest = std::min(nearest, derived(j).distance);
  return nearest;
}

std::vector<std::size_t> Submanifold::vertexIndices(int modes) const {
  const auto all = static_cast<std::size_t>(pga_->modes());
  if (modes < 0 || modes > pga_->modes())
    throw InvalidInput("modes", std::to_string(modes) + ", want 1 to " + std::to_string(all) + ", or 0 for all");
  const auto used = modes == 0 ? all : static_cast<std::size_t>(modes);
  std::vector<std::size_t> indices;
  for (const std::size_t offset : {std::size_t{0}, all})
    for (std::size_t j = 0; j < used; ++j) indices.push_back(offset + j);
  return indices;
}

Solved<Vertices> Submanifold::average(const Eigen::VectorXd& alpha, const Vertices& start,
                                      const SubmanifoldOptions& options) const {
  std::vector<std::size_t> used;
  for (Eigen::Index j = 0; j < alpha.size(); ++j)
    if (alpha[j] != 0) used.push_back(static_cast<std::size_t>(j));
  if (!prepare(used, options.stop)) return {start, {Termination::kCancelled, 0, 0}};
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(alpha.size());
  for (const auto j : used) forces[static_cast<Eigen::Index>(j)] = derived(j).force;
  ShellObjective objective(calculus_->structure(), calculus_->bending());
  objective.setReferenceNorm(alpha.dot(forces));
  for (const auto j : used)
    if (const double weight = alpha[static_cast<Eigen::Index>(j)]; weight > 0)
      objective.addUndeformed(derived(j).measures, weight);
  return minimiseShell(objective, *calculus_->structure(), start, {60, options.shape_tolerance, options.stop});
}

/// The local projection (18) at one point: the derivative of q(alpha) by the implicit function theorem (27)-(29), and
/// the Gauss-Newton model of W[s_loc, q(alpha)] that follows from it. Not to be used once the stop token has fired.
struct Submanifold::LocalProjection {
  Eigen::MatrixXd response;   ///< dq/dalpha, 3V x m
  Eigen::VectorXd gradient;   ///< of W[s_loc, q(alpha)], m
  Eigen::MatrixXd curvature;  ///< m x m, positive semi-definite
  bool usable = false;        ///< else no Hessian could be factorised, and all of this is zero

  LocalProjection(const Submanifold& owner, const ShellMeasures& target, const std::vector<std::size_t>& vertices,
                  const Eigen::VectorXd& alpha, const Vertices& q, const std::stop_token& stop) {
    const auto& calculus = *owner.calculus_;
    const auto& structure = *calculus.structure();
    const auto pins = gaugePins(q);
    const auto here = measure(calculus.topology(), q);
    const auto m = static_cast<Eigen::Index>(vertices.size());

    AverageEnergy energy(calculus.topology());
    for (Eigen::Index j = 0; j < m; ++j)
      energy.add(calculus.topology(), owner.derived(vertices[static_cast<std::size_t>(j)]).measures, calculus.bending(),
                 alpha[j]);
    SymmetricBlockMatrix hessian(structure.pattern());
    CholeskyFactor factor(structure.analysis());
    bool factorised = false;
    for (const auto kind : {HessianKind::kExact, HessianKind::kProjected}) {
      if (stop.stop_requested()) break;
      MeasureCurvature measures(calculus.topology(), kind);
      energy.addCurvature(calculus.topology(), here, 1, measures);
      hessian.setZero();
      pullBackHessian(structure, q, measures, hessian);
      factorised = factor.factorise(hessian, pins, stop);
      if (factorised) break;
    }
    response.setZero(q.size(), m);
    gradient.setZero(m);
    curvature.setZero(m, m);
    usable = factorised;
    if (!usable) return;
    for (Eigen::Index j = 0; j < m && !stop.stop_requested(); ++j)
      response.col(j) =
          -secondForce(calculus, owner.derived(vertices[static_cast<std::size_t>(j)]).measures, q, here, pins);
    factor.solve(response.data(), response.data(), static_cast<int>(m), stop);
    if (stop.stop_requested()) return;
    gradient = response.transpose() * secondForce(calculus, target, q, here, pins);

    MeasureCurvature measures(calculus.topology(), HessianKind::kProjected);
    addSecondCurvature(calculus.topology(), target, here, calculus.bending(), 1, measures);
    hessian.setZero();
    pullBackHessian(structure, q, measures, hessian);
    curvature = response.transpose() * (hessian * response);
    curvature = 0.5 * (curvature + curvature.transpose()).eval();
  }

  /// The step to the model's minimum on the simplex. Different weights can mean the same shape; the small proximal term
  /// keeps the nearest ones and does not move the optimum.
  Eigen::VectorXd step(const Eigen::VectorXd& alpha) const {
    const auto m = alpha.size();
    const double proximal = 1e-7 * curvature.trace() / static_cast<double>(m);
    const Eigen::MatrixXd b = curvature + proximal * Eigen::MatrixXd::Identity(m, m);
    return minimiseOnSimplex(b, gradient - b * alpha, alpha) - alpha;
  }
};

Solved<SubmanifoldPoint> Submanifold::optimiseWeights(const ShellMeasures& target,
                                                      const std::vector<std::size_t>& vertices, Eigen::VectorXd alpha,
                                                      const SubmanifoldOptions& options, Vertices& q,
                                                      double& energy) const {
  const auto& topology = calculus_->topology();
  // what (17) makes of W[mean, s_loc], and never less: near the mean the polyhedron's size is the measure
  const double reach = options.kappa * nearestVariation(vertices.size() / 2);
  const double size =
      std::max(reach * reach, shellEnergy(topology, measure(topology, pga_->mean), target, calculus_->bending()));
  const double noise = 3e-16 * target.area.sum();
  const auto spread = [&](const Eigen::VectorXd& used) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(2 * pga_->modes());
    for (std::size_t j = 0; j < vertices.size(); ++j)
      all[static_cast<Eigen::Index>(vertices[j])] = used[static_cast<Eigen::Index>(j)];
    return all;
  };
  const auto evaluate = [&](const Vertices& shape) {
    return shellEnergy(topology, target, measure(topology, shape), calculus_->bending());
  };
  Outcome outcome;
  auto solved = average(spread(alpha), q, options);
  q = std::move(solved.solution);
  energy = evaluate(q);
  Outcome shape_outcome = solved;  // of the solve that q comes from
  for (outcome.iterations = 0;; ++outcome.iterations) {
    outcome.termination = Termination::kCancelled;
    if (options.stop.stop_requested()) break;
    const LocalProjection model(*this, target, vertices, alpha, q, options.stop);
    if (options.stop.stop_requested()) break;
    outcome.termination = Termination::kNumericalFailure;
    if (!model.usable) break;
    const Eigen::VectorXd step = model.step(alpha);
    const double slope = model.gradient.dot(step);
    outcome.residual = std::sqrt(std::max(-slope, 0.0) / size);
    if (!std::isfinite(slope)) break;
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options.max_iterations) break;
    double length = 1;
    for (; length > 1e-4 && !options.stop.stop_requested(); length *= 0.5) {
      auto trial = average(spread(alpha + length * step), q + unflatten(length * (model.response * step)), options);
      const double trial_energy = evaluate(trial.solution);
      if (!(trial_energy <= energy + 1e-4 * length * slope + noise)) continue;
      alpha = (alpha + length * step).cwiseMax(0);
      alpha /= alpha.sum();
      q = std::move(trial.solution);
      energy = trial_energy;
      shape_outcome = trial;
      break;
    }
    outcome.termination = Termination::kStalled;
    if (length <= 1e-4 && !options.stop.stop_requested()) break;
  }
  if (!shape_outcome.converged()) outcome += shape_outcome;
  return {SubmanifoldPoint{spread(alpha), 1}, outcome};
}

SubmanifoldProjection Submanifold::meanProjection() const {
  const auto steps = static_cast<std::size_t>(pga_->path_steps);
  return {pointOf(Eigen::VectorXd::Zero(pga_->modes())), pga_->mean, pga_->mean, Path(steps + 1, pga_->mean), 0};
}

Solved<SubmanifoldProjection> Submanifold::project(const Vertices& shape, const SubmanifoldOptions& options,
                                                   const SubmanifoldProjection* warm) const {
  const auto vertices = vertexIndices(options.modes);
  const auto geodesic_options = geodesicOptions(options);
  if (!prepare(vertices, options.stop)) return {meanProjection(), {Termination::kCancelled, 0, 0}};
  auto path =
      calculus_->interpolate(pga_->mean, shape, pga_->path_steps, geodesic_options, warm ? warm->geodesic : Path{});
  Outcome outcome = path;
  SubmanifoldProjection result;
  const double distance = calculus_->distance(path.solution);
  const double nearest = nearestVariation(vertices.size() / 2);
  const double longest = 1.0 / pga_->path_steps;  // s_loc stays on the first segment
  result.point.scale = distance > 0 ? std::min(longest, options.kappa * nearest / distance) : longest;
  const auto local = calculus_->at(path.solution, result.point.scale, geodesic_options);
  outcome += local;
  if (outcome.termination == Termination::kCancelled) return {meanProjection(), outcome};

  Eigen::VectorXd start(static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t j = 0; j < vertices.size(); ++j)
    start[static_cast<Eigen::Index>(j)] = warm ? warm->point.alpha[static_cast<Eigen::Index>(vertices[j])] : 1.0;
  if (!(start.sum() > 0)) start.setOnes();  // warm, but with other modes
  start /= start.sum();
  result.local = warm ? warm->local : pga_->mean;
  const auto weights = optimiseWeights(measure(calculus_->topology(), local.solution), vertices, start, options,
                                       result.local, result.local_energy);
  outcome += weights;
  if (weights.termination == Termination::kCancelled) return {meanProjection(), outcome};
  result.point.alpha = weights.solution.alpha;
  auto scaled = rescale(result.local, result.point.scale, options);
  outcome += scaled;
  result.shape = std::move(scaled.solution);
  result.geodesic = std::move(path.solution);
  return {std::move(result), outcome};
}

Solved<Vertices> Submanifold::rescale(const Vertices& local, double scale, const SubmanifoldOptions& options) const {
  // Far from the mean (23) may have no solution for steps as long as a K-th of the way; then shorter ones.
  constexpr int most_steps = 4096;  // further out nobody waits for the answer that there is none
  int spent = 0;
  for (int steps = pga_->path_steps;; steps *= 2) {
    auto marched = march(local, scale, steps, options);
    spent += marched.iterations;
    if (marched.converged() || marched.termination == Termination::kCancelled || scale * steps > 1 ||
        steps > most_steps) {
      marched.iterations = spent;
      return marched;
    }
  }
}

Solved<Vertices> Submanifold::march(const Vertices& local, double scale, int steps,
                                    const SubmanifoldOptions& options) const {
  // The exact inverse of the scaling: local lies at rho times the steps on the first segment of a geodesic from the
  // mean, whose first node follows from (24) and the others by (23). So a shape whose local one is on the submanifold
  // comes back.
  //
  // No step starts from the nodes of a similar shape: a dent in one of them, where the surface has snapped through,
  // would be handed on from shape to shape.
  const auto geodesic_options = geodesicOptions(options);
  if (scale * steps > 1) return calculus_->at({pga_->mean, local}, 1 / scale, geodesic_options);
  auto first = calculus_->through(pga_->mean, local, scale * steps, geodesic_options);
  Outcome outcome = first;
  Vertices here = std::move(first.solution), before = pga_->mean;
  for (int k = 1; k < steps && outcome.converged(); ++k) {
    auto next = calculus_->extrapolate(before, here, geodesic_options);
    outcome += next;
    before = std::move(here);
    here = std::move(next.solution);
  }
  return {std::move(here), outcome};
}

Solved<SubmanifoldShape> Submanifold::shapeOf(const SubmanifoldPoint& point, const SubmanifoldOptions& options,
                                              const Vertices* near) const {
  if (point.alpha.size() != 2 * pga_->modes())
    throw InvalidInput(
        "alpha", "has " + std::to_string(point.alpha.size()) + " entries, want " + std::to_string(2 * pga_->modes()));
  for (Eigen::Index j = 0; j < point.alpha.size(); ++j)
    if (!(point.alpha[j] >= 0)) throw InvalidInput("alpha[" + std::to_string(j) + "]", "is negative or not a number");
  if (!(std::abs(point.alpha.sum() - 1) < 1e-6))
    throw InvalidInput("alpha", "sums to " + std::to_string(point.alpha.sum()) + ", want 1");
  if (!(point.scale > 0) || !std::isfinite(point.scale)) throw InvalidInput("scale", "must be a positive number");
  auto local = average(point.alpha, near ? *near : pga_->mean, options);
  if (local.termination == Termination::kCancelled) return {{pga_->mean, std::move(local.solution)}, local};
  auto scaled = rescale(local.solution, point.scale, options);
  Outcome outcome = local;
  outcome += scaled;
  return {{std::move(scaled.solution), std::move(local.solution)}, outcome};
}

Eigen::VectorXd Submanifold::tangentCoordinates(const SubmanifoldPoint& point) const {
  const auto modes = pga_->modes();
  Eigen::VectorXd coordinates = point.alpha.head(modes) - point.alpha.tail(modes);
  for (Eigen::Index j = 0; j < modes; ++j)
    if (coordinates[j] != 0) coordinates[j] *= distance(j);
  return coordinates / point.scale;
}

SubmanifoldPoint Submanifold::pointOf(const Eigen::VectorXd& tangent_coordinates) const {
  Eigen::VectorXd steps = tangent_coordinates;
  for (Eigen::Index j = 0; j < steps.size(); ++j)
    if (steps[j] != 0) steps[j] /= distance(j);
  const double total = steps.cwiseAbs().sum();
  const auto j = pga_->modes();
  SubmanifoldPoint point;
  if (!(total > 0)) {  // the mean: any variation balanced by its reflection
    point.alpha = Eigen::VectorXd::Constant(2 * j, 0.5 / static_cast<double>(j));
    return point;
  }
  point.alpha.resize(2 * j);
  point.alpha << steps.cwiseMax(0) / total, (-steps).cwiseMax(0) / total;
  point.scale = 1 / total;
  return point;
}

}  // namespace shaped
