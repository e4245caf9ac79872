#include "core/editing/handle_edit.h"

#include <limits>

#include "core/editing/projection_accelerator.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"

namespace shaped {
namespace {

Vertices wantedPositions(const std::vector<AnchorTarget>& handles) {
  Vertices wanted(static_cast<Eigen::Index>(handles.size()), 3);
  for (std::size_t l = 0; l < handles.size(); ++l) wanted.row(static_cast<Eigen::Index>(l)) = handles[l].position;
  return wanted;
}

class HandleEditor {
 public:
  HandleEditor(const Submanifold& submanifold, const std::vector<AnchorTarget>& handles,
               const HandleEditOptions& options)
      : submanifold_(submanifold),
        calculus_(submanifold.calculus()),
        handles_(handles),
        options_(options),
        wanted_(wantedPositions(handles)),
        size_(boundingBoxDiagonal(submanifold.pga().mean)),
        accelerator_(submanifold) {}

  Solved<HandleEdit> run();

 private:
  /// One point of the alternation: a shape that meets the handles, and its projection.
  struct State {
    Vertices shape;
    SubmanifoldProjection projection;
    double energy = std::numeric_limits<double>::infinity();  ///< W[shape, projection]
  };

  /// A prior that a round starts from, with its coordinates.
  struct Start {
    SubmanifoldPoint point;
    Vertices shape;
    bool extrapolated = false;
  };

  void place();
  Outcome approach();
  Outcome meetHandles(const Vertices& prior, Vertices& shape);
  Outcome round(const Vertices& prior, State& state);
  double relativeFall(const State& before, const State& after) const;
  Start plainStart() const { return {state_.projection.point, state_.projection.shape, false}; }
  void chooseStart(Outcome& outcome);
  Outcome alternate();
  double handleDistance(const Vertices& shape) const {
    return (anchorPositions(calculus_.topology(), handles_, shape) - wanted_).rowwise().norm().maxCoeff();
  }
  double energy(const Vertices& shape, const Vertices& projection) const {
    return shellEnergy(calculus_.topology(), shape, projection, calculus_.bending());
  }

  const Submanifold& submanifold_;
  const GeodesicCalculus& calculus_;
  std::vector<AnchorTarget> handles_;
  const HandleEditOptions& options_;
  Vertices wanted_;
  double size_;
  ProjectionAccelerator accelerator_;
  State state_;
  Start start_;
  std::vector<AnchorTarget> shifted_;  ///< the handles with the multipliers of the last constrained solve
  std::vector<double> energies_;
};

/// The mean, placed by its handle points.
void HandleEditor::place() {
  for (auto& handle : handles_) handle.weight = 1;
  const auto& pga = submanifold_.pga();
  state_.shape = apply(alignRigidly(anchorPositions(calculus_.topology(), handles_, pga.mean), wanted_), pga.mean);
  state_.projection.point = submanifold_.pointOf(Eigen::VectorXd::Zero(pga.modes()));
  state_.projection.shape = state_.projection.local = state_.shape;
  shifted_ = handles_;
  for (auto& handle : shifted_) handle.weight = 100;
}

/// Soft handles with growing weights, the projection following: from the mean to the neighbourhood of the solution.
Outcome HandleEditor::approach() {
  Outcome outcome;
  for (const double weight : {0.03, 0.3}) {
    for (auto& handle : handles_) handle.weight = weight;
    auto fit = fitAnchored(calculus_, state_.projection.shape, handles_, state_.shape,
                           {1, 60, 1e-4, options_.submanifold.stop});
    state_.shape = std::move(fit.solution);
    auto projected = submanifold_.project(state_.shape, options_.submanifold,
                                          state_.projection.geodesic.empty() ? nullptr : &state_.projection);
    outcome.iterations += fit.iterations + projected.iterations;
    if (!projected.converged()) break;
    state_.projection = std::move(projected.solution);
  }
  return outcome;
}

/// min over s of W[s, prior] with the handles met: shifting the targets by the accumulated misses is the augmented
/// Lagrangian's multiplier update. The multipliers hardly change from round to round, so each starts with the last
/// ones.
Outcome HandleEditor::meetHandles(const Vertices& prior, Vertices& shape) {
  Outcome outcome;
  for (int update = 0; update < 30; ++update) {
    auto fit = fitAnchored(calculus_, prior, shifted_, shape, {1, 60, 1e-9, options_.submanifold.stop});
    shape = std::move(fit.solution);
    outcome.iterations += fit.iterations;
    outcome.residual = handleDistance(shape) / size_;
    outcome.termination = fit.termination;
    if (outcome.residual <= options_.handle_tolerance || fit.termination == Termination::kCancelled) break;
    const Vertices miss = anchorPositions(calculus_.topology(), handles_, shape) - wanted_;
    for (std::size_t l = 0; l < shifted_.size(); ++l)
      shifted_[l].position -= miss.row(static_cast<Eigen::Index>(l)).transpose();
    outcome.termination = Termination::kIterationLimit;
  }
  return outcome;
}

/// s for this prior, then P[s].
Outcome HandleEditor::round(const Vertices& prior, State& state) {
  Outcome outcome = meetHandles(prior, state.shape);
  outcome.residual = 0;  // of the handles; the alternation has its own
  if (!outcome.converged()) return outcome;
  auto projected = submanifold_.project(state.shape, options_.submanifold,
                                        state.projection.geodesic.empty() ? nullptr : &state.projection);
  outcome += projected;
  if (!projected.converged()) return outcome;
  state.projection = std::move(projected.solution);
  state.energy = energy(state.shape, state.projection.shape);
  return outcome;
}

/// Over the energy plus a tenth of the squared distance that the edit moves the model: where the submanifold meets
/// the handles the energy itself goes to zero.
double HandleEditor::relativeFall(const State& before, const State& after) const {
  const double reach = energy(submanifold_.pga().mean, after.projection.shape);
  return (before.energy - after.energy) / (after.energy + 0.1 * reach);
}

/// Where the next round starts: at the last projection, or ahead of it where the accelerator sees a way.
void HandleEditor::chooseStart(Outcome& outcome) {
  accelerator_.add({start_.point}, {state_.projection.point});
  start_ = plainStart();
  const auto proposed = accelerator_.propose();
  if (!proposed) return;
  auto ahead = submanifold_.shapeOf(proposed->point, options_.submanifold, &state_.projection.local);
  outcome.iterations += ahead.iterations;
  if (ahead.converged()) start_ = {proposed->point, std::move(ahead.solution.shape), true};
}

Outcome HandleEditor::alternate() {
  Outcome outcome{Termination::kIterationLimit, 0, 1};
  int small_falls = 0;  // in a row
  for (int outer = 0; outer < options_.outer_iterations; ++outer) {
    State next = state_;
    const auto done = round(start_.shape, next);
    outcome.iterations += done.iterations;
    const bool better = done.converged() && next.energy < state_.energy;
    if (!better && start_.extrapolated && done.termination != Termination::kCancelled) {
      accelerator_.forget();  // it led astray: back to plain alternation from the last state
      start_ = plainStart();
      continue;
    }
    if (!done.converged()) {
      if (energies_.empty()) state_ = std::move(next);
      return {done.termination, outcome.iterations, outcome.residual};
    }
    if (!better) return {Termination::kConverged, outcome.iterations, 0};  // P[s] cannot lower the energy
    energies_.push_back(next.energy);
    outcome.residual = energies_.size() > 1 ? relativeFall(state_, next) : 1;
    // a plain step may be short because the alternation is slow, so the extrapolated one after it must be short too
    small_falls = outcome.residual <= options_.tolerance ? small_falls + 1 : 0;
    state_ = std::move(next);
    if (small_falls == 2) return {Termination::kConverged, outcome.iterations, outcome.residual};
    chooseStart(outcome);
  }
  return outcome;
}

Solved<HandleEdit> HandleEditor::run() {
  place();
  const auto approached = approach();
  start_ = plainStart();
  auto outcome = alternate();
  outcome.iterations += approached.iterations;
  HandleEdit edit{std::move(state_.shape), std::move(state_.projection), std::move(energies_), 0};
  edit.largest_handle_distance = handleDistance(edit.shape);
  edit.projection.shape = apply(alignRigidly(edit.projection.shape, edit.shape), edit.projection.shape);
  return {std::move(edit), outcome};
}

}  // namespace

Solved<HandleEdit> editByHandles(const Submanifold& submanifold, const std::vector<AnchorTarget>& handles,
                                 const HandleEditOptions& options) {
  auto weighted = handles;
  for (auto& handle : weighted) handle.weight = 1;
  if (!determinePlacement(weighted))
    throw InvalidInput("handles",
                       "are fewer than three or lie on one line; they must determine where the shape stands");
  return HandleEditor(submanifold, handles, options).run();
}

}  // namespace shaped
