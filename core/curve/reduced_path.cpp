#include "core/curve/reduced_path.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "core/curve/curve.h"
#include "core/curve/reduced_path_flow.h"
#include "core/curve/reduced_path_newton.h"
#include "core/curve/reduced_solver.h"

namespace shaped {
namespace {

constexpr double kAtFrame = 1e-9;  ///< of a segment: no average needed
/// Frames that are resampled one after the other, each with the inverse Hessian that the one before left behind.
constexpr std::size_t kTogether = 8;

ReducedSolver solverFor(const GhostSpace& space, double bending, const ReducedPathOptions& options) {
  return {FrameSpace{&space}, {bending, options.symmetry}, options.tolerance, options.stop};
}

/// As pointOf().
Solved<Eigen::VectorXd> pointBy(ReducedSolver& solver, const PathCoordinates& path, double share) {
  const double position = share * static_cast<double>(path.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), path.size() - 2);
  const double rest = position - static_cast<double>(below);
  if (rest < kAtFrame) return {path[below], {}};
  if (rest > 1 - kAtFrame) return {path[below + 1], {}};
  const auto& topology = *solver.space().shared->topology();
  const auto from = measure(topology, solver.space().ghost(path[below]));
  const auto to = measure(topology, solver.space().ghost(path[below + 1]));
  return solver.average({{&from, 1 - rest}, {&to, rest}}, (1 - rest) * path[below] + rest * path[below + 1]);
}

}  // namespace

Outcome settle(const GhostSpace& space, double bending, PathCoordinates& path, const ReducedPathOptions& options) {
  if (options.solver == PathSolver::kFlow) return settleByFlow(space, bending, path, options);
  return ReducedPathNewton(space, bending, options).settle(path);
}

double pathEnergy(const GhostSpace& space, double bending, const PathCoordinates& path) {
  Curve curve{std::vector<Vertices>(path.size()), false};
  tbb::parallel_for(std::size_t{0}, path.size(),
                    [&](std::size_t i) { curve.frames[i] = FrameSpace{&space}.ghost(path[i]); });
  const auto segments = segmentEnergies(*space.topology(), bending, curve, measuresOf(*space.topology(), curve));
  return std::accumulate(segments.begin(), segments.end(), 0.0);
}

Solved<Eigen::VectorXd> pointOf(const GhostSpace& space, double bending, const PathCoordinates& path, double share,
                                const ReducedPathOptions& options) {
  auto solver = solverFor(space, bending, options);
  return pointBy(solver, path, share);
}

PathCoordinates resampled(const GhostSpace& space, double bending, const PathCoordinates& path, std::size_t frames,
                          const ReducedPathOptions& options) {
  PathCoordinates result(frames);
  tbb::parallel_for(std::size_t{0}, (frames + kTogether - 1) / kTogether, [&](std::size_t block) {
    auto solver = solverFor(space, bending, options);
    for (std::size_t i = block * kTogether; i < std::min((block + 1) * kTogether, frames); ++i)
      result[i] = pointBy(solver, path, static_cast<double>(i) / static_cast<double>(frames - 1)).solution;
  });
  return result;
}

PathCoordinates extended(const PathCoordinates& path, const GhostSpace& space) {
  auto result = path;
  for (auto& coordinates : result) {
    const auto before = coordinates.size();
    coordinates.conservativeResize(space.dimension());
    coordinates.tail(space.dimension() - before).setZero();
  }
  return result;
}

}  // namespace shaped
