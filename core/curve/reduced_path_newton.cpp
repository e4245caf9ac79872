#include "core/curve/reduced_path_newton.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/curve/reduced_average.h"
#include "core/numerics/newton.h"

namespace shaped {
namespace {

constexpr double kLeastShift = 1e-10, kMostShift = 1e-3;  ///< of the Hessian, times the mean of its diagonal

/// Whether steps with one Hessian are still worth their time.
class Pace {
 public:
  explicit Pace(double residual) : residual_(residual) {}
  /// After a step.
  bool keepsUp(double residual) {
    if (++steps_ < kSteps) return true;
    const bool fast = residual <= kLeft * residual_;
    *this = Pace(residual);
    return fast;
  }

 private:
  static constexpr int kSteps = 6;
  static constexpr double kLeft = 0.2;  ///< of the residual, at most, after so many steps
  double residual_;
  int steps_ = 0;
};

}  // namespace

ReducedPathNewton::State ReducedPathNewton::stateOf(PathCoordinates path) const {
  State state{std::move(path), {{}, false}, {}, 0, 0};
  state.curve.frames.resize(state.path.size());
  tbb::parallel_for(std::size_t{0}, state.path.size(),
                    [&](std::size_t i) { state.curve.frames[i] = FrameSpace{&space_}.ghost(state.path[i]); });
  state.measures = measuresOf(*space_.topology(), state.curve);
  const auto segments = segmentEnergies(*space_.topology(), energy_.bending(), state.curve, state.measures);
  state.energy = std::accumulate(segments.begin(), segments.end(), 0.0);
  state.noise = 1e-14 * static_cast<double>(segments.size()) * state.measures.front().area.sum();
  return state;
}

ReducedPathNewton::State ReducedPathNewton::moved(const State& state, const Eigen::VectorXd& step) const {
  auto path = state.path;
  for (std::size_t k = 0; k + 2 < path.size(); ++k)
    path[k + 1] += step.segment(static_cast<Eigen::Index>(k) * space_.dimension(), space_.dimension());
  return stateOf(std::move(path));
}

Eigen::VectorXd ReducedPathNewton::gradientAt(const State& state) const {
  const auto& topology = *space_.topology();
  const auto dimension = space_.dimension();
  Eigen::VectorXd gradient(static_cast<Eigen::Index>(state.path.size() - 2) * dimension);
  tbb::parallel_for(std::size_t{0}, state.path.size() - 2, [&](std::size_t k) {
    const auto& measures = state.measures;
    const Vertices force =
        curveGradient(topology, energy_, state.curve.frames[k + 1], measures[k], measures[k + 1], measures[k + 2]);
    gradient.segment(static_cast<Eigen::Index>(k) * dimension, dimension).noalias() =
        space_.basis().transpose() * Eigen::Map<const Eigen::VectorXd>(force.data(), force.size());
  });
  return gradient;
}

Eigen::MatrixXd ReducedPathNewton::diagonalBlock(const State& state, std::size_t k, HessianKind kind) const {
  const auto &before = state.measures[k], &here = state.measures[k + 1], &after = state.measures[k + 2];
  MeasureCurvature curvature(*space_.topology(), kind);
  energy_.addSecondCurvature(*space_.topology(), before, here, kBothDirections, curvature);
  energy_.addFirstCurvature(*space_.topology(), here, after, kBothDirections, curvature);
  SymmetricBlockMatrix hessian(space_.structure().pattern());
  pullBackHessian(space_.structure(), state.curve.frames[k + 1], curvature, hessian);
  return basis_.transpose() * (hessian * basis_);
}

Eigen::MatrixXd ReducedPathNewton::blockAbove(const State& state, std::size_t k) const {
  GeneralBlockMatrix coupling(space_.structure().pattern());
  energy_.addMixedHessian(space_.structure(), state.curve.frames[k + 1], state.measures[k + 1],
                          state.curve.frames[k + 2], state.measures[k + 2], kBothDirections, coupling);
  return basis_.transpose() * (coupling * basis_);
}

bool ReducedPathNewton::factoriseShifted(const std::vector<Eigen::MatrixXd>& diagonal,
                                         const std::vector<Eigen::MatrixXd>& above, double most) {
  double scale = 0;
  for (const auto& block : diagonal) scale = std::max(scale, block.trace() / static_cast<double>(block.rows()));
  for (double shift = kLeastShift; shift <= most; shift *= 10)
    if (factor_.factorise(diagonal, above, shift * scale)) return true;
  return false;
}

bool ReducedPathNewton::factoriseAt(const State& state) {
  if (basis_.cols() != space_.dimension()) basis_ = space_.basis();
  const std::size_t inner = state.path.size() - 2;
  std::vector<Eigen::MatrixXd> diagonal(inner), above(inner - 1);
  const auto eachFrame = [&](const auto& body) {
    tbb::parallel_for(std::size_t{0}, inner, [&](std::size_t k) {
      if (!options_.stop.stop_requested()) body(k);
    });
    return !options_.stop.stop_requested();
  };
  const auto exactly = [&](std::size_t k) {
    diagonal[k] = diagonalBlock(state, k, HessianKind::kExact);
    if (k + 1 < inner) above[k] = blockAbove(state, k);
  };
  if (!eachFrame(exactly)) return false;
  if (factoriseShifted(diagonal, above, kMostShift)) return true;
  // Far from any geodesic: each frame on its own, as the flow has it, with elements that are not indefinite.
  const auto safely = [&](std::size_t k) {
    diagonal[k] = diagonalBlock(state, k, HessianKind::kProjected);
    if (k + 1 < inner) above[k].setZero();
  };
  return eachFrame(safely) && factoriseShifted(diagonal, above, 1);
}

Outcome ReducedPathNewton::settle(PathCoordinates& path) {
  if (path.size() < 3) return {};
  State now = stateOf(path);
  Eigen::VectorXd gradient = gradientAt(now);
  bool usable = factor_.blocks() == path.size() - 2 && factor_.size() == space_.dimension();
  bool fresh = false;  // the Hessian is that of where the path is now
  pairs_.clear();
  std::optional<Pace> pace;
  Outcome outcome;
  for (;; ++outcome.iterations) {
    outcome.termination = Termination::kNumericalFailure;
    if (!std::isfinite(now.energy)) return outcome;
    outcome.termination = Termination::kCancelled;
    if (options_.stop.stop_requested()) break;
    if (!usable) {
      pairs_.clear();
      pace.reset();
      usable = fresh = factoriseAt(now);
      if (!usable && !options_.stop.stop_requested()) outcome.termination = Termination::kNumericalFailure;
      if (!usable) break;
    }
    const Eigen::VectorXd descent =
        pairs_.multiply([&](const Eigen::VectorXd& v) { return factor_.solve(v); }, gradient);
    const double slope = gradient.dot(descent);
    outcome.residual = std::sqrt(std::max(slope, 0.0) / std::max(now.energy, now.noise));
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options_.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options_.steps) break;
    if (!pace) pace.emplace(outcome.residual);
    State next;
    const auto moveTo = [&](double t) {
      next = moved(now, -t * descent);
      return next.energy;
    };
    const double length = backtrack(moveTo, now.energy, -slope, now.noise);
    outcome.termination = Termination::kStalled;
    if (length == 0 && fresh) break;
    if (length > 0) {
      now = std::move(next);
      const Eigen::VectorXd before = std::exchange(gradient, gradientAt(now));
      pairs_.add(-length * descent, gradient - before);
      fresh = false;
    }
    usable = length > 0 && pace->keepsUp(outcome.residual);
  }
  path = now.path;
  return outcome;
}

}  // namespace shaped
