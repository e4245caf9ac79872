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
  const double position = share * static_cast<double>(path.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), path.size() - 2);
  const double rest = position - static_cast<double>(below);
  if (rest < kAtFrame) return {path[below], {}};
  if (rest > 1 - kAtFrame) return {path[below + 1], {}};
  const FrameSpace frame{&space};
  const auto from = measure(*space.topology(), frame.ghost(path[below]));
  const auto to = measure(*space.topology(), frame.ghost(path[below + 1]));
  ReducedSolver solver(frame, {bending, options.symmetry}, options.tolerance, options.stop);
  return solver.average({{&from, 1 - rest}, {&to, rest}}, (1 - rest) * path[below] + rest * path[below + 1]);
}

PathCoordinates resampled(const GhostSpace& space, double bending, const PathCoordinates& path, std::size_t frames,
                          const ReducedPathOptions& options) {
  PathCoordinates result(frames);
  tbb::parallel_for(std::size_t{0}, frames, [&](std::size_t i) {
    const double share = static_cast<double>(i) / static_cast<double>(frames - 1);
    result[i] = pointOf(space, bending, path, share, options).solution;
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
