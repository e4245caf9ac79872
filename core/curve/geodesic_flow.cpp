#include "core/curve/geodesic_flow.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/curve/path_enrichment.h"
#include "core/curve/travel.h"
#include "core/geodesic/length_angle.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/reduction/krylov.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

constexpr std::size_t kRough = 5;  ///< frames of the first path, with blends between the ends

/// Shapes whose lengths and angles are blends of the ends', between them. Empty when one cannot be built.
std::vector<Vertices> blends(const TopologyPtr& topology, const Vertices& a, const Vertices& b,
                             const std::stop_token& stop) {
  const LengthAngleReconstruction reconstruction(topology);
  const auto from = measure(*topology, a), to = measure(*topology, b);
  std::vector<Vertices> shapes;
  for (std::size_t k = 1; k + 1 < kRough; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(kRough - 1);
    auto shape = reconstruction.reconstruct(blendMeasures(from, to, share), shapes.empty() ? a : shapes.back(), stop);
    if (shape.rows() == 0) return {};
    shapes.push_back(apply(alignRigidly(shape, a), shape));
  }
  return shapes;
}

/// Coarse to fine in time.
class Refinement {
 public:
  Refinement(const ShellStructurePtr& structure, GhostSpace& space, double bending, const GeodesicFlowOptions& options)
      : structure_(structure),
        space_(space),
        bending_(bending),
        options_(options),
        settling_{options.solver, options.symmetry, options.tolerance, options.steps, options.stop} {}

  /// A geodesic with as many frames as wanted, between the ends of a path with no more.
  Solved<PathCoordinates> run(PathCoordinates path, const ProgressSink& progress) {
    const auto wanted = static_cast<std::size_t>(options_.frames);
    Outcome outcome;
    if (path.size() > 2) settle(path, outcome);
    while (path.size() < wanted && outcome.termination != Termination::kCancelled) {
      const auto segments = (path.size() - 1) * static_cast<std::size_t>(options_.insert + 1);
      path = resampled(space_, bending_, path, std::min(segments, wanted - 1) + 1, settling_);
      settle(path, outcome);
      if (progress)
        progress({std::to_string(path.size()) + " frames",
                  static_cast<double>(path.size()) / static_cast<double>(wanted), outcome.residual});
    }
    return {std::move(path), outcome};
  }
  const PathEnrichment& lastEnrichment() const { return last_; }

 private:
  void settle(PathCoordinates& path, Outcome& outcome) {
    outcome += shaped::settle(space_, bending_, path, settling_);
    const auto enough = static_cast<std::size_t>(std::min(options_.rough, options_.frames));
    if (path.size() >= enough && path.size() > 2 && !enriched_) enrichAll(path, outcome);
  }

  /// Adds directions to the space and settles the path in it again, until little is missing or nothing helps.
  void enrichAll(PathCoordinates& path, Outcome& outcome) {
    enriched_ = true;
    for (int round = 0; round < options_.enrichments; ++round) {
      if (outcome.termination == Termination::kCancelled) return;
      const auto before =
          std::exchange(last_, enrich(structure_, bending_, space_, {path}, options_.accuracy, options_.stop));
      path = extended(path, space_);
      if (last_.added > 0) outcome += shaped::settle(space_, bending_, path, settling_);
      if (!last_.worthAnother(before)) return;
    }
  }

  const ShellStructurePtr& structure_;
  GhostSpace& space_;
  double bending_;
  const GeodesicFlowOptions& options_;
  ReducedPathOptions settling_;
  PathEnrichment last_;
  bool enriched_ = false;
};

}  // namespace

std::optional<std::string> GeodesicFlowOptions::firstViolation() const {
  const auto whole = [](const char* name, std::int64_t value, int least) {
    return std::string(name) + " = " + std::to_string(value) + ", want >= " + std::to_string(least);
  };
  if (frames < 2) return whole("frames", frames, 2);
  if (insert < 1) return whole("insert", insert, 1);
  if (dimension < 1) return whole("dimension", dimension, 1);
  if (ghost_vertices < 4) return whole("ghost_vertices", ghost_vertices, 4);
  if (enrichments < 0) return whole("enrichments", enrichments, 0);
  if (rough < 3) return whole("rough", rough, 3);
  if (steps < 1) return whole("steps", steps, 1);
  if (!(tolerance > 0)) return "tolerance = " + std::to_string(tolerance) + ", want > 0";
  if (!(accuracy > 0)) return "accuracy = " + std::to_string(accuracy) + ", want > 0";
  if (solver == PathSolver::kNewton && symmetry == EnergySymmetry::kDirected)
    return "symmetry = directed, but only the flow can average by (10)";
  return std::nullopt;
}

Solved<GeodesicFlow> geodesicByFlow(const ShellStructurePtr& structure, double bending, const Vertices& a,
                                    const Vertices& b, const GeodesicFlowOptions& options,
                                    const ProgressSink& progress) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  requireOneComponent(structure->topology(), "topology");
  requireValidShape(structure->topology(), a, "a");
  requireValidShape(structure->topology(), b, "b");
  const auto onto_a = alignRigidly(b, a);
  const Vertices aligned = apply(onto_a, b);
  Solved<GeodesicFlow> result({Curve{{a, b}, false}}, {});
  // Each of these is one thing after the other, and none needs the others.
  Solved<ShapeSubspace> subspace;
  std::vector<Vertices> between;
  std::shared_ptr<const Coarsening> ghost = options.ghost;
  tbb::parallel_invoke(
      [&] {
        if (!ghost)
          ghost = std::make_shared<const Coarsening>(
              coarsen(structure->topologyPtr(), {a, aligned}, {options.ghost_vertices, {}, options.stop}));
      },
      [&] { subspace = krylovSubspace(structure, bending, a, aligned, options.dimension, options.stop); },
      [&] {
        if (static_cast<std::size_t>(options.frames) >= kRough)
          between = blends(structure->topologyPtr(), a, aligned, options.stop);
      });
  if (!subspace.converged()) return {std::move(result.solution), subspace};
  for (const auto& shape : between) subspace.solution.append(flatten(shape) - flatten(a));
  PathCoordinates start{subspace.solution.coordinates(a)};
  for (const auto& shape : between) start.push_back(subspace.solution.coordinates(shape));
  start.push_back(subspace.solution.coordinates(aligned));
  GhostSpace space(*ghost, std::move(subspace.solution));
  Refinement refinement(structure, space, bending, options);
  const auto path = refinement.run(std::move(start), progress);
  if (path.termination == Termination::kCancelled) return {std::move(result.solution), path};

  const Travel travel({RigidMotion{}, inverse(onto_a)}, a.colwise().mean().transpose());
  auto& frames = result.solution.curve.frames;
  frames.assign(path.solution.size(), a);
  frames.back() = b;
  tbb::parallel_for(std::size_t{1}, frames.size() - 1, [&](std::size_t i) {
    // The energy does not mind where in space a shape of the subspace is.
    const Vertices shape = space.fine().shape(path.solution[i]);
    const Vertices still = apply(alignRigidly(shape, a), shape);
    frames[i] = apply(travel.at(static_cast<double>(i) / static_cast<double>(frames.size() - 1)), still);
  });
  result.solution.path_energy = pathEnergy(space, bending, path.solution);
  result.solution.dimension = space.dimension();
  result.solution.full_residual = refinement.lastEnrichment().residual;
  result.solution.missing = refinement.lastEnrichment().missing;
  return {std::move(result.solution), path};
}

}  // namespace shaped
