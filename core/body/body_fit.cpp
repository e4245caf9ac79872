#include "core/body/body_fit.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <deque>

#include "core/body/body_residuals.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"

namespace shaped {
namespace {

void requireTargets(std::span<const SurfaceTarget> targets, std::int32_t vertex_count) {
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto& target = targets[i];
    const std::string where = "targets[" + std::to_string(i) + "]";
    for (const auto corner : target.corners)
      if (corner < 0 || corner >= vertex_count)
        throw InvalidInput(
            where, "names vertex " + std::to_string(corner) + ", and the model has " + std::to_string(vertex_count));
    if (!target.position.allFinite() || !target.normal.allFinite()) throw InvalidInput(where, "is not finite");
    if (!(std::abs(target.barycentric.sum() - 1) < 1e-6)) throw InvalidInput(where, "has shares that do not sum to 1");
    if (!(target.weight >= 0) || !std::isfinite(target.weight)) throw InvalidInput(where, "has a weight below 0");
  }
}

/// Ends the solver when the stop token fires, and tells how far it is.
class SolverWatch : public ceres::IterationCallback {
 public:
  SolverWatch(std::stop_token stop, int max_iterations) : stop_(std::move(stop)), max_iterations_(max_iterations) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    done_ = iteration.iteration;
    return stopped() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

  bool stopped() const { return stop_.stop_requested(); }
  /// Whether the step that is under way is the last, whatever it brings.
  bool inLastStep() const { return done_ + 1 >= max_iterations_; }

 private:
  std::stop_token stop_;
  int max_iterations_, done_ = -1;
};

/// The energy as Ceres sees it: of [J r] only its square root, the triangular factor, with one row more than there are
/// parameters. It has the same steps, gradients and costs, and spares Ceres the work on thousands of rows.
class Cost : public ceres::CostFunction {
 public:
  Cost(const BodyModel& model, const BodyResiduals& residuals, const SolverWatch& watch)
      : model_(model), residuals_(residuals), watch_(watch) {
    set_num_residuals(int(residuals.parameterCount()) + 1);
    *mutable_parameter_block_sizes() = {int(model.modeCount()), 6};
    if (const int joints = 3 * model.skeleton().jointCount() - 3; joints > 0)
      mutable_parameter_block_sizes()->push_back(joints);
  }

  bool Evaluate(double const* const* parameters, double* values, double** jacobians) const override {
    if (watch_.stopped()) return stopped(values, jacobians);
    const BodyState state = stateOf(parameters);
    if (!state.identity.allFinite() || !state.pose.translation.allFinite() || !state.pose.rotations.allFinite())
      return false;
    const Eigen::Index n = residuals_.parameterCount();
    Eigen::Map<Eigen::VectorXd> residual(values, n + 1);
    if (!jacobians || watch_.inLastStep()) {
      residual.setZero();
      residual[0] = std::sqrt(residuals_.energy(state, skinOf(state)));
      // Ceres asks for derivatives after the last step, too, and takes no step by them: of three steps they are a
      // quarter of the work.
      if (jacobians) setZero(jacobians);
      return true;
    }
    const Eigen::LDLT<Eigen::MatrixXd> factor(residuals_.squares(state, skinOf(state)));
    // Of P^T L D L^T P: sqrt(D) L^T P. Pivoted, as the energy may leave a direction open.
    Eigen::MatrixXd root = factor.transpositionsP() * Eigen::MatrixXd::Identity(n + 1, n + 1);
    root = factor.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal() * (factor.matrixU() * root);
    residual = root.col(n);
    Eigen::Index column = 0;
    for (std::size_t block = 0; block < parameter_block_sizes().size(); ++block) {
      const Eigen::Index size = parameter_block_sizes()[block];
      if (jacobians[block])
        Eigen::Map<BodyResiduals::Rows>(jacobians[block], n + 1, size) = root.middleCols(column, size);
      column += size;
    }
    return true;
  }

 private:
  /// What takes no time, until the callback ends the solver: an iteration over many frames would take long. Steps are
  /// refused; derivatives may not be, or Ceres would report a failure on stderr.
  bool stopped(double* values, double** jacobians) const {
    if (!jacobians) return false;
    std::fill_n(values, num_residuals(), 0.0);
    setZero(jacobians);
    return true;
  }

  void setZero(double** jacobians) const {
    for (std::size_t block = 0; block < parameter_block_sizes().size(); ++block)
      if (jacobians[block]) std::fill_n(jacobians[block], num_residuals() * parameter_block_sizes()[block], 0.0);
  }

  BodyState stateOf(double const* const* parameters) const {
    BodyState state = model_.meanState();
    state.identity = Eigen::Map<const Eigen::VectorXd>(parameters[0], model_.modeCount());
    state.pose.translation = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    std::copy_n(parameters[1] + 3, 3, state.pose.rotations.data());
    if (parameter_block_sizes().size() > 2)
      std::copy_n(parameters[2], parameter_block_sizes()[2], state.pose.rotations.data() + 3);
    return state;
  }

  /// The last is kept: Ceres asks for derivatives where it has just asked for the cost.
  const PosedSkin& skinOf(const BodyState& state) const {
    const bool same = skin_ && state.identity == of_.identity && toVector(state.pose) == toVector(of_.pose);
    if (!same) skin_.emplace(model_.posed(state));
    of_ = state;
    return *skin_;
  }

  const BodyModel& model_;
  const BodyResiduals& residuals_;
  const SolverWatch& watch_;
  mutable std::optional<PosedSkin> skin_;
  mutable BodyState of_;
};

/// Keeps the joints (not the root) within the limits, and moves the start there.
void applyLimits(ceres::Problem& problem, const JointLimits& limits, double* rotations) {
  for (Eigen::Index i = 0; i < limits.low.size() - 3; ++i) {
    const double low = limits.low.data()[3 + i], high = limits.high.data()[3 + i];
    rotations[i] = std::clamp(rotations[i], low, high);
    if (low > -1e6) problem.SetParameterLowerBound(rotations, int(i), low);
    if (high < 1e6) problem.SetParameterUpperBound(rotations, int(i), high);
  }
}

/// One frame's pose as Ceres moves it, and its cost.
class FittedFrame {
 public:
  FittedFrame(const BodyModel& model, std::span<const SurfaceTarget> targets, const BodyFitOptions& options,
              const Pose& pose, double prior_share, const SolverWatch& watch)
      : residuals_(model, targets, options, prior_share), cost_(model, residuals_, watch), pose_(pose) {
    placement_ << pose.translation, pose.rotations.row(0).transpose();
  }
  FittedFrame(const FittedFrame&) = delete;

  void addTo(ceres::Problem& problem, Eigen::VectorXd& identity, const BodyModel& model,
             const BodyFitOptions& options) {
    std::vector<double*> blocks{identity.data(), placement_.data()};
    double* const joints = pose_.rotations.data() + 3;
    const bool jointed = pose_.rotations.rows() > 1;
    if (jointed) blocks.push_back(joints);
    problem.AddResidualBlock(&cost_, nullptr, blocks);
    if (!options.placement) problem.SetParameterBlockConstant(placement_.data());
    if (!jointed) return;
    if (!options.pose)
      problem.SetParameterBlockConstant(joints);
    else if (options.limits && model.parts().limits)
      applyLimits(problem, *model.parts().limits, joints);
  }

  Pose pose() const {
    Pose result = pose_;
    result.translation = placement_.head<3>();
    result.rotations.row(0) = placement_.tail<3>().transpose();
    return result;
  }

 private:
  BodyResiduals residuals_;
  Cost cost_;
  Eigen::Matrix<double, 6, 1> placement_;
  Pose pose_;
};

Outcome outcomeOf(const ceres::Solver::Summary& summary) {
  Outcome outcome;
  outcome.iterations = std::max(0, int(summary.iterations.size()) - 1);
  if (summary.iterations.size() > 1) {
    const auto& last = summary.iterations.back();
    outcome.residual = std::abs(last.cost_change) / std::max(last.cost, 1e-300);
  }
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
      outcome.termination = Termination::kConverged;
      break;
    case ceres::NO_CONVERGENCE:
      outcome.termination = Termination::kIterationLimit;
      break;
    case ceres::USER_FAILURE:
      outcome.termination = Termination::kCancelled;
      break;
    default:
      outcome.termination = Termination::kNumericalFailure;
  }
  return outcome;
}

ceres::Solver::Options solverOptions(const BodyFitOptions& options, ceres::IterationCallback* callback) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.gradient_tolerance = 0;
  solver.parameter_tolerance = 1e-12;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  solver.callbacks.push_back(callback);
  return solver;
}

}  // namespace

std::optional<std::string> BodyFitOptions::firstViolation() const {
  if (auto problem = unlessPositive("sigma", sigma)) return problem;
  if (auto problem = unlessPositive("observations", observations)) return problem;
  if (auto problem = unlessPositive("pose_deviation", pose_deviation)) return problem;
  if (auto problem = unlessPositive("tolerance", tolerance)) return problem;
  if (!(prior >= 0) || !std::isfinite(prior)) return "prior = " + std::to_string(prior) + ", want >= 0";
  if (max_iterations < 1) return "max_iterations = " + std::to_string(max_iterations) + ", want >= 1";
  return std::nullopt;
}

Solved<BodySequence> fitBodies(const BodyModel& model, const BodySequence& start,
                               std::span<const std::vector<SurfaceTarget>> targets, const BodyFitOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  if (targets.empty() || start.poses.size() != targets.size())
    throw InvalidInput("start.poses", "has " + std::to_string(start.poses.size()) + " entries and targets " +
                                          std::to_string(targets.size()) + ", want one for each of at least one frame");
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  Eigen::VectorXd identity = start.identity;
  SolverWatch watch(options.stop, options.max_iterations);
  std::deque<FittedFrame> frames;  // they stay where Ceres was told
  for (std::size_t f = 0; f < targets.size(); ++f) {
    requireTargets(targets[f], model.topology()->vertexCount());
    model.posed({start.identity, start.poses[f]});  // says what does not fit
    frames.emplace_back(model, targets[f], options, start.poses[f], 1.0 / double(targets.size()), watch);
    frames.back().addTo(problem, identity, model, options);
  }
  if (!options.identity) problem.SetParameterBlockConstant(identity.data());
  ceres::Solver::Summary summary;
  ceres::Solve(solverOptions(options, &watch), &problem, &summary);
  Outcome outcome = outcomeOf(summary);
  // Once the token has fired the cost tells nothing.
  if (options.stop.stop_requested()) outcome.termination = Termination::kCancelled;
  if (outcome.termination == Termination::kNumericalFailure) return {start, outcome};
  BodySequence solution{std::move(identity), {}};
  for (const auto& frame : frames) solution.poses.push_back(frame.pose());
  return {std::move(solution), outcome};
}

Solved<BodyState> fitBody(const BodyModel& model, const BodyState& start, std::span<const SurfaceTarget> targets,
                          const BodyFitOptions& options) {
  const std::vector<SurfaceTarget> frame(targets.begin(), targets.end());
  const auto solved = fitBodies(model, {start.identity, {start.pose}}, {&frame, 1}, options);
  return {BodyState{solved.solution.identity, solved.solution.poses.front()}, solved};
}

std::vector<SurfaceTarget> vertexTargets(const Vertices& shape) {
  std::vector<SurfaceTarget> targets;
  for (std::int32_t v = 0; v < shape.rows(); ++v)
    targets.push_back({{v, v, v}, Eigen::Vector3d::UnitX(), shape.row(v).transpose()});
  return targets;
}

}  // namespace shaped
