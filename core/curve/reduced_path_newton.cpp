#include "core/curve/reduced_path_newton.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/curve/reduced_average.h"
#include "core/numerics/newton.h"

namespace shaped {
namespace {

constexpr double kLeastShift = 1e-10, kMostShift = 1e-3;  ///< of the Hessian, times the mean of its diagonal
constexpr double kGoodStep = 1. / 3;  ///< of the residual, at most, is left by a step with a Hessian that is still good

double dot(const std::vector<Eigen::VectorXd>& a, const std::vector<Eigen::VectorXd>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(),
                            [](const Eigen::VectorXd& x, const Eigen::VectorXd& y) { return x.dot(y); });
}

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

std::vector<Eigen::VectorXd> ReducedPathNewton::gradientAt(const State& state) const {
  const auto& topology = *space_.topology();
  std::vector<Eigen::VectorXd> gradient(state.path.size() - 2);
  tbb::parallel_for(std::size_t{0}, gradient.size(), [&](std::size_t k) {
    const auto& measures = state.measures;
    const Vertices force =
        curveGradient(topology, energy_, state.curve.frames[k + 1], measures[k], measures[k + 1], measures[k + 2]);
    gradient[k] = space_.basis().transpose() * Eigen::Map<const Eigen::VectorXd>(force.data(), force.size());
  });
  return gradient;
}

template <class Multiply>
Eigen::MatrixXd ReducedPathNewton::projected(const Multiply& multiply) const {
  const auto& basis = space_.basis();
  Eigen::MatrixXd image = Eigen::MatrixXd::Zero(basis.rows(), basis.cols());
  for (Eigen::Index j = 0; j < basis.cols(); ++j) multiply(basis.col(j).data(), image.col(j).data());
  return basis.transpose() * image;
}

Eigen::MatrixXd ReducedPathNewton::diagonalBlock(const State& state, std::size_t k, HessianKind kind) const {
  const auto &before = state.measures[k], &here = state.measures[k + 1], &after = state.measures[k + 2];
  MeasureCurvature curvature(*space_.topology(), kind);
  energy_.addSecondCurvature(*space_.topology(), before, here, kBothDirections, curvature);
  energy_.addFirstCurvature(*space_.topology(), here, after, kBothDirections, curvature);
  SymmetricBlockMatrix hessian(space_.structure().pattern());
  pullBackHessian(space_.structure(), state.curve.frames[k + 1], curvature, hessian);
  return projected([&](const double* x, double* y) { hessian.multiplyAdd(x, y); });
}

Eigen::MatrixXd ReducedPathNewton::blockAbove(const State& state, std::size_t k) const {
  GeneralBlockMatrix coupling(space_.structure().pattern());
  energy_.addMixedHessian(space_.structure(), state.curve.frames[k + 1], state.measures[k + 1],
                          state.curve.frames[k + 2], state.measures[k + 2], kBothDirections, coupling);
  return projected([&](const double* x, double* y) { coupling.multiplyAdd(1, x, y); });
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
  const bool kept = factor_.blocks() == path.size() - 2 && factor_.size() == space_.dimension();
  double last = kept ? std::numeric_limits<double>::infinity() : 0;  // residual; 0 asks for a new factor
  Outcome outcome;
  for (;; ++outcome.iterations) {
    outcome.termination = Termination::kNumericalFailure;
    if (!std::isfinite(now.energy)) return outcome;
    outcome.termination = Termination::kCancelled;
    if (options_.stop.stop_requested()) break;
    const auto gradient = gradientAt(now);
    const auto step = stepFrom(now, gradient, last);
    if (!step.found) {
      if (!options_.stop.stop_requested()) outcome.termination = Termination::kNumericalFailure;
      break;
    }
    outcome.residual = step.residual;
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options_.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options_.steps) break;
    State next;
    const auto moveTo = [&](double t) {
      auto moved = now.path;
      for (std::size_t k = 0; k < gradient.size(); ++k) moved[k + 1] -= t * step.descent[k];
      next = stateOf(std::move(moved));
      return next.energy;
    };
    const bool lower = backtrack(moveTo, now.energy, -dot(gradient, step.descent), now.noise) > 0;
    outcome.termination = Termination::kStalled;
    if (!lower && step.fresh) break;
    if (lower) now = std::move(next);
    last = lower ? step.residual : 0;
  }
  path = now.path;
  return outcome;
}

ReducedPathNewton::Step ReducedPathNewton::stepFrom(const State& state, const std::vector<Eigen::VectorXd>& gradient,
                                                    double last) {
  const auto residual = [&](const std::vector<Eigen::VectorXd>& descent) {
    return std::sqrt(std::max(dot(gradient, descent), 0.0) / std::max(state.energy, state.noise));
  };
  Step step;
  if (last > 0) {
    step.descent = factor_.solve(gradient);
    step.residual = residual(step.descent);
    step.found = step.residual <= std::max(options_.tolerance, kGoodStep * last);
    if (step.found) return step;
  }
  step.found = step.fresh = factoriseAt(state);
  if (!step.found) return step;
  step.descent = factor_.solve(gradient);
  step.residual = residual(step.descent);
  return step;
}

}  // namespace shaped
