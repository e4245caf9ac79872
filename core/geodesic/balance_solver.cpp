#include "core/geodesic/balance_solver.h"

#include <cmath>

#include "core/numerics/gmres.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

/// Which of W's arguments is the unknown shape; the other is `current`, at which forces are balanced.
enum class Unknown { kDeformed, kUndeformed };

class BalanceSolver {
 public:
  BalanceSolver(const ShellStructure& structure, const PairEnergy& energy, const Vertices& current, Unknown unknown,
                const Vertices& known_neighbour, double force, const std::stop_token& stop)
      : structure_(structure),
        topology_(structure.topology()),
        energy_(energy),
        unknown_(unknown),
        current_(current),
        current_measures_(measure(topology_, current)),
        pins_(gaugePins(current)),
        metric_(structure.analysis()),
        mixed_(structure.pattern()) {
    const auto neighbour = measure(topology_, known_neighbour);
    MeasureGradient gradient(topology_);
    if (unknown == Unknown::kDeformed)
      energy.addSecondGradient(topology_, neighbour, current_measures_, 1, gradient);
    else
      energy.addFirstGradient(topology_, current_measures_, neighbour, 1, gradient);
    known_ = force * pullBack(gradient);
    floor_ = forceFloor(topology_, current_, current_measures_, energy_.bending());
    factoriseMetric(stop);
  }

  /// Newton's method on known * amount + force(x) = 0; false when it does not reach the tolerance.
  bool solve(double amount, Vertices& x, const GeodesicOptions& options, Outcome& outcome);
  /// Of the whole equation at x.
  double residual(const Vertices& x) const {
    const Eigen::VectorXd own = force(x);
    return (own + known_).norm() / (own.norm() + known_.norm() + floor_);
  }
  const Vertices& current() const { return current_; }

 private:
  Eigen::VectorXd pullBack(const MeasureGradient& gradient) const {
    Vertices force = Vertices::Zero(current_.rows(), 3);
    pullBackGradient(topology_, current_, gradient, force);
    Eigen::VectorXd result = flatten(force);
    pins_.clear(result.data());
    return result;
  }

  Eigen::VectorXd force(const Vertices& x) const {
    const auto measures = measure(topology_, x);
    if (!(measures.area.minCoeff() > 0)) return Eigen::VectorXd::Constant(x.size(), std::nan(""));
    MeasureGradient gradient(topology_);
    if (unknown_ == Unknown::kDeformed)
      energy_.addFirstGradient(topology_, current_measures_, measures, 1, gradient);
    else
      energy_.addSecondGradient(topology_, measures, current_measures_, 1, gradient);
    return pullBack(gradient);
  }

  /// The metric of shape space at `current`, half the Hessian of W[current, .] at rest.
  void factoriseMetric(const std::stop_token& stop) {
    MeasureCurvature curvature(topology_, HessianKind::kExact);
    energy_.addSecondCurvature(topology_, current_measures_, current_measures_, 1, curvature);
    SymmetricBlockMatrix hessian(structure_.pattern());
    pullBackHessian(structure_, current_, curvature, hessian);
    usable_ = metric_.factorise(hessian, pins_, stop);
  }

  double dualNorm(const Eigen::VectorXd& f) const {
    Eigen::VectorXd solved(f.size());
    metric_.solve(f.data(), solved.data());
    return std::sqrt(std::max(f.dot(solved), 0.0));
  }

  Eigen::VectorXd direction(const Vertices& x, const Eigen::VectorXd& imbalance, const std::stop_token& stop);

  const ShellStructure& structure_;
  const Topology& topology_;
  PairEnergy energy_;
  Unknown unknown_;
  Vertices current_;
  ShellMeasures current_measures_;
  Pins pins_;
  CholeskyFactor metric_;
  GeneralBlockMatrix mixed_;
  Eigen::VectorXd known_;
  double floor_ = 0;
  bool usable_ = false;
};

Eigen::VectorXd BalanceSolver::direction(const Vertices& x, const Eigen::VectorXd& imbalance,
                                         const std::stop_token& stop) {
  const auto measures = measure(topology_, x);
  mixed_.setZero();
  if (unknown_ == Unknown::kDeformed)
    energy_.addMixedHessian(structure_, current_, current_measures_, x, measures, 1, mixed_);
  else
    energy_.addMixedHessian(structure_, x, measures, current_, current_measures_, 1, mixed_);
  const auto apply = [&](const Eigen::VectorXd& v, Eigen::VectorXd& y) {
    y.setZero(v.size());
    if (unknown_ == Unknown::kDeformed)
      mixed_.multiplyAdd(-1, v.data(), y.data());
    else
      mixed_.multiplyTransposedAdd(-1, v.data(), y.data());
    pins_.clear(y.data());
  };
  const auto precondition = [&](const Eigen::VectorXd& v, Eigen::VectorXd& y) {
    y.resize(v.size());
    metric_.solve(v.data(), y.data());
  };
  Eigen::VectorXd step;
  gmres(apply, precondition, imbalance, 1e-4, 120, step, stop);  // the map is minus the mixed Hessian
  return step;
}

bool BalanceSolver::solve(double amount, Vertices& x, const GeodesicOptions& options, Outcome& outcome) {
  const auto fail = [&](Termination termination) {
    outcome.termination = termination;
    return false;
  };
  if (options.stop.stop_requested()) return fail(Termination::kCancelled);
  if (!usable_) return fail(Termination::kNumericalFailure);
  Eigen::VectorXd own = force(x);
  for (int iteration = 0;; ++iteration, ++outcome.iterations) {
    Eigen::VectorXd imbalance = own + amount * known_;
    if (!imbalance.allFinite()) return fail(Termination::kNumericalFailure);
    outcome.residual = imbalance.norm() / (own.norm() + amount * known_.norm() + floor_);
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options.tolerance) return true;
    if (iteration >= options.max_iterations) return fail(Termination::kIterationLimit);
    if (options.stop.stop_requested()) return fail(Termination::kCancelled);
    const Eigen::VectorXd step = direction(x, imbalance, options.stop);
    const double merit = dualNorm(imbalance);
    double length = 1;
    for (;; length *= 0.5) {
      if (options.stop.stop_requested()) return fail(Termination::kCancelled);
      if (length < 1.0 / 64) return fail(Termination::kStalled);
      const Vertices trial = x + length * unflatten(step);
      Eigen::VectorXd trial_force = force(trial);
      if (!trial_force.allFinite() || !(dualNorm(trial_force + amount * known_) < (1 - 0.1 * length) * merit)) continue;
      x = trial;
      own = std::move(trial_force);
      break;
    }
  }
}

/// Tries the whole force at once from the predicted start, then in growing stages from `current`.
Solved<Vertices> solveBalance(BalanceSolver solver, const Vertices& start, const GeodesicOptions& options) {
  Outcome outcome;
  Vertices x = start;
  if (solver.solve(1, x, options, outcome) || outcome.termination == Termination::kCancelled) return {x, outcome};
  double reached = 0, stage = 0.5;
  Vertices here = solver.current();
  while (reached < 1) {
    const double amount = std::min(1.0, reached + stage);
    x = here;
    if (solver.solve(amount, x, options, outcome)) {
      here = std::move(x);
      reached = amount;
      stage *= 1.5;
      continue;
    }
    if (outcome.termination == Termination::kCancelled) break;
    stage *= 0.5;
    if (stage < 1e-3) break;
  }
  if (reached < 1) {
    if (outcome.termination == Termination::kNumericalFailure) here = start;
    outcome.residual = solver.residual(here);
  }
  return {here, outcome};
}

}  // namespace

Solved<Vertices> solveForDeformed(const ShellStructure& structure, const PairEnergy& energy, const Vertices& previous,
                                  const Vertices& current, const Vertices& start, const GeodesicOptions& options,
                                  double force) {
  if (options.stop.stop_requested()) return {start, Outcome{Termination::kCancelled, 0, 1}};
  return solveBalance(BalanceSolver(structure, energy, current, Unknown::kDeformed, previous, force, options.stop),
                      start, options);
}

Solved<Vertices> solveForUndeformed(const ShellStructure& structure, const PairEnergy& energy, const Vertices& current,
                                    const Vertices& next, const Vertices& start, const GeodesicOptions& options) {
  if (options.stop.stop_requested()) return {start, Outcome{Termination::kCancelled, 0, 1}};
  return solveBalance(BalanceSolver(structure, energy, current, Unknown::kUndeformed, next, 1, options.stop), start,
                      options);
}

}  // namespace shaped
