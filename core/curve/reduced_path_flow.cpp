#include "core/curve/reduced_path_flow.h"

#include "core/curve/reduced_solver.h"

namespace shaped {

Outcome settleByFlow(const GhostSpace& space, double bending, PathCoordinates& path,
                     const ReducedPathOptions& options) {
  Curve curve{{}, false};
  std::vector<ReducedSolver> solvers;
  for (const auto& coordinates : path) {
    curve.frames.push_back(FrameSpace{&space}.ghost(coordinates));
    solvers.emplace_back(FrameSpace{&space}, PairEnergy(bending, options.symmetry), options.tolerance, options.stop);
  }
  const auto average = [&](std::size_t i, const FrameTerms& terms, const FlowFrame& now) {
    auto solved = solvers[i].average(terms.shapes, now.coordinates);
    return Solved<FlowFrame>({solvers[i].space().ghost(solved.solution), solved.solution}, solved);
  };
  const bool exact = options.symmetry == EnergySymmetry::kSymmetric;
  SmoothingFlow flow(space.topology(), bending, curve, path, {average},
                     {.tau = 1, .control = exact, .place = false, .stop = options.stop});
  Outcome outcome{Termination::kIterationLimit, 0, 0};
  for (int k = 0; k < options.steps; ++k) {
    const auto step = flow.step();
    outcome.iterations += step.iterations;
    outcome.residual = step.residual;
    if (step.converged()) continue;
    outcome.termination = step.solution.stationary ? Termination::kConverged : step.termination;
    break;
  }
  for (std::size_t i = 0; i < path.size(); ++i) path[i] = flow.frame(i).coordinates;
  return outcome;
}

}  // namespace shaped
