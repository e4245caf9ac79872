#include "core/numerics/newton.h"

#include <cmath>
#include <limits>

namespace shaped {
namespace {

/// One run of the method: current iterate, its gradient, and what is reused from step to step. Looks at the stop token
/// around every Hessian, in every factorisation, and at every value of the line search.
class NewtonRun {
 public:
  NewtonRun(NewtonObjective& objective, const CholeskyAnalysisPtr& analysis, const Eigen::VectorXd& start,
            std::stop_token stop)
      : objective_(objective),
        stop_(std::move(stop)),
        factor_(analysis),
        hessian_(analysis->pattern()),
        x_(start),
        direction_(start.size()) {}

  bool stopped() const { return stop_.stop_requested(); }

  double residual() {
    const double scale = objective_.gradient(x_, gradient_);
    pins_ = objective_.pins(x_);
    pins_.clear(gradient_.data());
    const double norm = gradient_.norm();
    return norm == 0 ? 0 : norm / scale;
  }

  /// Newton's direction; false when neither Hessian could be factorised, or stopped.
  bool findDirection() {
    for (const bool projected : {false, true}) {
      hessian_.setZero();
      objective_.hessian(x_, projected, hessian_);
      if (stopped()) return false;
      const bool positive = factor_.factorise(hessian_, pins_, stop_);
      if (stopped()) return false;
      if (!positive) continue;
      factor_.solve(gradient_.data(), direction_.data());
      direction_ = -direction_;
      if (direction_.allFinite() && direction_.dot(gradient_) < 0) return true;
    }
    return false;
  }

  /// False when no length lowers the objective, or stopped.
  bool step() {
    constexpr double never = std::numeric_limits<double>::infinity();
    const double length = backtrack([&](double t) { return stopped() ? never : objective_.value(x_ + t * direction_); },
                                    objective_.value(x_), direction_.dot(gradient_), objective_.noise());
    x_ += length * direction_;
    return length > 0;
  }

  const Eigen::VectorXd& x() const { return x_; }

 private:
  NewtonObjective& objective_;
  std::stop_token stop_;
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
  NewtonRun run(objective, analysis, start, options.stop);
  const auto unless_stopped = [&](Termination otherwise) {
    return run.stopped() ? Termination::kCancelled : otherwise;
  };
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
    if (run.stopped()) break;
    if (!run.findDirection()) {
      outcome.termination = unless_stopped(Termination::kNumericalFailure);
      break;
    }
    if (!run.step()) {
      outcome.termination = unless_stopped(Termination::kStalled);
      break;
    }
    outcome.termination = Termination::kConverged;
  }
  return {outcome.termination == Termination::kNumericalFailure ? start : run.x(), outcome};
}

}  // namespace shaped
