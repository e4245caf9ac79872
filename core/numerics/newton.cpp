#include "core/numerics/newton.h"

#include <cmath>

namespace shaped {
namespace {

/// One run of the method: current iterate, its gradient, and what is reused from step to step.
class NewtonRun {
 public:
  NewtonRun(NewtonObjective& objective, const CholeskyAnalysisPtr& analysis, const Eigen::VectorXd& start)
      : objective_(objective), factor_(analysis), hessian_(analysis->pattern()), x_(start), direction_(start.size()) {}

  double residual() {
    const double scale = objective_.gradient(x_, gradient_);
    pins_ = objective_.pins(x_);
    pins_.clear(gradient_.data());
    const double norm = gradient_.norm();
    return norm == 0 ? 0 : norm / scale;
  }

  /// Newton's direction; false when neither Hessian could be factorised.
  bool findDirection() {
    for (const bool projected : {false, true}) {
      hessian_.setZero();
      objective_.hessian(x_, projected, hessian_);
      if (!factor_.factorise(hessian_, pins_)) continue;
      factor_.solve(gradient_.data(), direction_.data());
      direction_ = -direction_;
      if (direction_.allFinite() && direction_.dot(gradient_) < 0) return true;
    }
    return false;
  }

  bool step() {
    const double length = backtrack([this](double t) { return objective_.value(x_ + t * direction_); },
                                    objective_.value(x_), direction_.dot(gradient_), objective_.noise());
    x_ += length * direction_;
    return length > 0;
  }

  const Eigen::VectorXd& x() const { return x_; }

 private:
  NewtonObjective& objective_;
  CholeskyFactor factor_;
  SymmetricBlockMatrix hessian_;
  Pins pins_;
  Eigen::VectorXd x_, gradient_, direction_;
};

}  // namespace

double backtrack(const std::function<double(double)>& value, double at_zero, double slope, double noise) {
  constexpr double sufficient = 1e-4;
  for (double t = 1; t > 1e-12; t *= 0.5)
    if (value(t) <= at_zero + sufficient * t * slope + noise) return t;
  return 0;
}

Solved<Eigen::VectorXd> minimise(NewtonObjective& objective, const CholeskyAnalysisPtr& analysis,
                                 const Eigen::VectorXd& start, const NewtonOptions& options) {
  NewtonRun run(objective, analysis, start);
  Outcome outcome;
  for (outcome.iterations = 0;; ++outcome.iterations) {
    outcome.residual = run.residual();
    if (!std::isfinite(outcome.residual)) {
      outcome.termination = Termination::kNumericalFailure;
      return {start, outcome};
    }
    if (outcome.residual <= options.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options.max_iterations) break;
    outcome.termination = Termination::kCancelled;
    if (options.stop.stop_requested()) break;
    outcome.termination = Termination::kNumericalFailure;
    if (!run.findDirection()) break;
    outcome.termination = Termination::kStalled;
    if (!run.step()) break;
    outcome.termination = Termination::kConverged;
  }
  return {outcome.termination == Termination::kNumericalFailure ? start : run.x(), outcome};
}

}  // namespace shaped
