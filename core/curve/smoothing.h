#pragma once

#include "core/curve/reduced_curve.h"
#include "core/numerics/progress.h"

namespace shaped {

struct SmoothingOptions {
  int steps = 10;             ///< of the flow, >= 0; fewer where it becomes stationary
  bool reduced = true;        ///< in a subspace, on a ghost mesh; else at full resolution
  SmoothingFlowOptions flow;  ///< its stop token is also that of the reduction
  ReducedCurveOptions reduction;

  /// "steps = -1, want >= 0"; empty when all is well for so many frames.
  std::optional<std::string> firstViolation(std::size_t frames) const;
};

struct Smoothed {
  Curve curve;
  std::vector<SmoothingStep> steps;                      ///< that were taken
  double flow_energy_before = 0;                         ///< path energy before the first of them [m^2]
  Eigen::Index dimension = 0;                            ///< of the subspace that all frames share; 0: full resolution
  bool stationary = false;                               ///< nothing more to gain; fewer steps than asked for, then
  double path_energy_before = 0, path_energy_after = 0;  ///< (4) of the curve as it came and as it is [m^2]
  std::vector<double> gradient_before, gradient_after;   ///< gradientNorms() of the curve as it came and as it is
};

/// Smooths a curve by steps of the flow ([BvTH16] (2)). Both numbers and gradients are of the mesh itself, also where
/// the flow ran on a ghost mesh; those of the steps and flow_energy_before are of the mesh that it ran on.
///
/// Cancelled: the curve after the steps so far. Stalled or numerical failure: no step could be taken any more though
/// the curve is not stationary, as SmoothingFlow::step. Throws as ReducedCurve or SmoothingFlow. progress: after each
/// step.
Solved<Smoothed> smoothed(const ShellStructurePtr& structure, double bending, const Curve& curve,
                          const SmoothingOptions& options, const ProgressSink& progress = {});

}  // namespace shaped
