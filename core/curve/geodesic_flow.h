#pragma once

#include <memory>
#include <optional>

#include "core/curve/curve.h"
#include "core/curve/reduced_path.h"
#include "core/numerics/progress.h"
#include "core/numerics/solved.h"

namespace shaped {

struct GeodesicFlowOptions {
  int frames = 64;                     ///< of the geodesic with both ends, >= 2
  int insert = 3;                      ///< frames between two at each temporal refinement, >= 1
  int dimension = 14;                  ///< of the Krylov subspace to begin with, >= 1
  int rough = 5;                       ///< frames of the rough geodesic by which the subspace is enriched, >= 3
  int enrichments = 2;                 ///< of the subspace at most, >= 0
  double accuracy = 1e-5;              ///< > 0; no more enrichments once GeodesicFlow::missing is below
  std::int32_t ghost_vertices = 1250;  ///< of the mesh on which energies are evaluated, >= 4
  std::shared_ptr<const Coarsening> ghost =
      {};  ///< that mesh, where there is one already; else it is made for the ends
  EnergySymmetry symmetry = EnergySymmetry::kSymmetric;  ///< of the flow's averages: (1), or (10) at half the cost
  PathSolver solver = PathSolver::kNewton;
  double tolerance = 1e-4;  ///< as ReducedPathOptions::tolerance
  int steps = 500;          ///< of the solver at most, on each level, >= 1
  std::stop_token stop = {};

  /// "frames = 1, want >= 2"; empty when all is well.
  std::optional<std::string> firstViolation() const;
};

struct GeodesicFlow {
  Curve curve;                 ///< its ends are a and b themselves
  double path_energy = 0;      ///< (4) on the ghost mesh [m^2]
  Eigen::Index dimension = 0;  ///< of the subspace in the end
  /// Of the rough geodesic at full resolution before the last enrichment, as FlowTangents::residual and
  /// PathEnrichment::missing; 0 without one.
  double full_residual = 0, missing = 0;
};

/// A discrete geodesic from a to b by the curve smoothing flow in a subspace ([BvTH16] sections 6 and 7): starting from
/// few frames, more are inserted as averages of their neighbours and the flow runs until no frame has anything to gain,
/// level after level. The subspace is krylovSubspace(), enriched (ours): by shapes whose lengths and angles are blends
/// of the ends', which also are the first frames between them (the ends alone lead astray where limbs turn far); and by
/// the flow tangents at full resolution of the rough geodesic of five frames, which tell where it wants to leave the
/// subspace. Shapes between turn and travel evenly from a's position to b's.
///
/// Iteration limit: a level did not become stationary in so many steps. Numerical failure: a shape is too close to
/// degenerate. Throws InvalidInput naming "a", "b", "topology" or "options". Runs parallel loops in the current TBB
/// arena.
Solved<GeodesicFlow> geodesicByFlow(const ShellStructurePtr& structure, double bending, const Vertices& a,
                                    const Vertices& b, const GeodesicFlowOptions& options,
                                    const ProgressSink& progress = {});

}  // namespace shaped
