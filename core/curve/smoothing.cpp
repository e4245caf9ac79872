#include "core/curve/smoothing.h"

#include <tbb/parallel_for.h>

#include <numeric>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Takes the steps; false where the caller stopped them.
Outcome run(SmoothingFlow& flow, const SmoothingOptions& options, Smoothed& result, const ProgressSink& progress) {
  Outcome outcome;
  result.flow_energy_before = flow.pathEnergy();
  for (int k = 0; k < options.steps; ++k) {
    const auto step = flow.step();
    outcome.iterations += step.iterations;
    outcome.residual = step.residual;
    if (step.converged()) {
      result.steps.push_back(step.solution);
      if (progress)
        progress({"step " + std::to_string(k + 1), static_cast<double>(k + 1) / options.steps, step.residual});
      continue;
    }
    result.stationary = step.solution.stationary;
    if (!result.stationary) outcome.termination = step.termination;
    break;
  }
  return outcome;
}

}  // namespace

std::optional<std::string> SmoothingOptions::firstViolation(std::size_t frames) const {
  if (steps < 0) return "steps = " + std::to_string(steps) + ", want >= 0";
  if (reduction.dimension < 1) return "dimension = " + std::to_string(reduction.dimension) + ", want >= 1";
  if (reduction.ghost_vertices < 4)
    return "ghost_vertices = " + std::to_string(reduction.ghost_vertices) + ", want >= 4";
  return flow.firstViolation(frames);
}

Solved<Smoothed> smoothed(const ShellStructurePtr& structure, double bending, const Curve& curve,
                          const SmoothingOptions& options, const ProgressSink& progress) {
  const auto& topology = structure->topology();
  requireCurve(topology, curve, "frames");
  if (const auto violation = options.firstViolation(curve.size())) throw InvalidInput("options", *violation);
  Solved<Smoothed> result;
  auto& smooth = result.solution;
  smooth.curve = curve;
  const auto energyAndGradient = [&](std::vector<double>& gradient) {
    const auto measures = measuresOf(topology, smooth.curve);
    gradient = gradientNorms(topology, bending, smooth.curve, measures);
    const auto segments = segmentEnergies(topology, bending, smooth.curve, measures);
    return std::accumulate(segments.begin(), segments.end(), 0.0);
  };
  smooth.path_energy_before = energyAndGradient(smooth.gradient_before);
  auto reduction = options.reduction;
  reduction.stop = options.flow.stop;
  if (options.reduced) {
    const ReducedCurve reduced(structure->topologyPtr(), bending, curve, reduction);
    smooth.dimension = reduced.space().dimension();
    auto flow = reduced.flow(options.flow);
    static_cast<Outcome&>(result) = run(flow, options, smooth, progress);
    if (!smooth.steps.empty())
      tbb::parallel_for(std::size_t{0}, curve.size(), [&](std::size_t i) {
        if (flow.free(i)) smooth.curve.frames[i] = reduced.fine(i, flow.frame(i));
      });
  } else {
    SmoothingFlow flow(structure, {bending, EnergySymmetry::kSymmetric}, curve, options.flow);
    static_cast<Outcome&>(result) = run(flow, options, smooth, progress);
    smooth.curve = flow.curve();
  }
  smooth.path_energy_after = energyAndGradient(smooth.gradient_after);
  return result;
}

}  // namespace shaped
