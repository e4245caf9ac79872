#include "core/geodesic/geodesic.h"

#include <cmath>
#include <numeric>

#include "core/geodesic/balance_solver.h"
#include "core/geodesic/elastic_network.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

Outcome worse(Outcome a, const Outcome& b) { return a += b; }

Solved<Path> cancelledPath(const Vertices& a, const Vertices& b, int steps) {
  Path untouched(static_cast<std::size_t>(steps), a);
  untouched.push_back(b);
  return {std::move(untouched), Outcome{Termination::kCancelled, 0, 1}};
}

Vertices aligned(const Vertices& shape, const Vertices& to) { return apply(alignRigidly(shape, to), shape); }

}  // namespace

GeodesicCalculus::GeodesicCalculus(ShellStructurePtr structure, const PairEnergy& energy)
    : structure_(std::move(structure)),
      energy_(energy),
      reconstruction_(std::make_shared<LengthAngleReconstruction>(structure_->topologyPtr())) {}

std::vector<double> GeodesicCalculus::segmentEnergies(const Path& path) const {
  std::vector<double> energies;
  ShellMeasures before = measure(topology(), path.front()), after;
  for (std::size_t k = 1; k < path.size(); ++k) {
    measure(topology(), path[k], after);
    energies.push_back(energy_.value(topology(), before, after));
    std::swap(before, after);
  }
  return energies;
}

double GeodesicCalculus::pathEnergy(const Path& path) const {
  const auto energies = segmentEnergies(path);
  return static_cast<double>(energies.size()) * std::accumulate(energies.begin(), energies.end(), 0.0);
}

double GeodesicCalculus::distance(const Path& geodesic) const { return std::sqrt(std::max(pathEnergy(geodesic), 0.0)); }

Path GeodesicCalculus::startPath(const Vertices& a, const Vertices& b, int steps, const std::stop_token& stop) const {
  const auto from = measure(topology(), a), to = measure(topology(), b);
  Path path{a};
  for (int k = 1; k < steps; ++k) {
    if (stop.stop_requested()) return {};
    path.push_back(
        reconstruction_->reconstruct(blendMeasures(from, to, static_cast<double>(k) / steps), path.back(), stop));
    if (path.back().rows() == 0) return {};
  }
  path.push_back(b);
  return path;
}

Solved<Path> GeodesicCalculus::relaxPath(Path path, const GeodesicOptions& options) const {
  const auto count = static_cast<std::int32_t>(path.size());
  ElasticNetwork network{std::move(path), std::vector<bool>(static_cast<std::size_t>(count), true), {}};
  network.free.front() = network.free.back() = false;
  for (std::int32_t k = 0; k + 1 < count; ++k) network.segments.push_back({k, k + 1, static_cast<double>(count - 1)});
  auto solved =
      relax(structure_, energy_, std::move(network), {options.max_iterations, options.tolerance, options.stop, {}});
  return {std::move(solved.solution.nodes), solved};
}

Solved<Path> GeodesicCalculus::cascade(const Vertices& a, const Vertices& b, int steps,
                                       const GeodesicOptions& options) const {
  Path path{a, b};
  GeodesicOptions rough = options;
  rough.tolerance = std::max(options.tolerance, 1e-3);
  Outcome outcome;
  while (static_cast<int>(path.size()) - 1 < steps) {
    Path finer{path.front()};
    for (std::size_t k = 0; k + 1 < path.size(); ++k) {
      if (options.stop.stop_requested()) return cancelledPath(a, b, steps);
      auto middle = between(path[k], path[k + 1], 0.5, rough);
      outcome = worse(outcome, middle);
      finer.push_back(std::move(middle.solution));
      finer.push_back(path[k + 1]);
    }
    auto relaxed = relaxPath(std::move(finer), rough);
    outcome.iterations += relaxed.iterations;
    path = std::move(relaxed.solution);
  }
  Path chosen;
  const auto available = static_cast<double>(path.size() - 1);
  for (int k = 0; k <= steps; ++k) chosen.push_back(path[static_cast<std::size_t>(std::lround(available * k / steps))]);
  auto solved = relaxPath(std::move(chosen), options);
  solved.iterations += outcome.iterations;
  return solved;
}

Solved<Path> GeodesicCalculus::interpolate(const Vertices& a, const Vertices& b, int steps,
                                           const GeodesicOptions& options, const Path& warm) const {
  if (steps < 1) throw InvalidInput("path_steps", std::to_string(steps) + ", want >= 1");
  requireValidShape(topology(), a, "a");
  requireValidShape(topology(), b, "b");
  if (steps == 1) return {Path{a, b}, Outcome{}};
  if (warm.size() == static_cast<std::size_t>(steps) + 1) {
    // inner shapes follow the end by their share of its displacement
    const Vertices displacement = aligned(b, warm.back()) - warm.back();
    Path path = warm;
    for (int k = 1; k < steps; ++k)
      path[static_cast<std::size_t>(k)] += (static_cast<double>(k) / steps) * displacement;
    if (!std::isfinite(pathEnergy(path)) || pathEnergy(path) > 2 * pathEnergy(warm)) path = warm;
    path.front() = a;
    path.back() = b;
    if (std::isfinite(pathEnergy(path))) {
      auto solved = relaxPath(std::move(path), options);
      if (solved.converged() || solved.termination == Termination::kCancelled) return solved;
    }
  }
  const double direct = energy_.value(topology(), measure(topology(), a), measure(topology(), b));
  Path start = startPath(a, aligned(b, a), steps, options.stop);
  if (options.stop.stop_requested()) {
    return cancelledPath(a, b, steps);
  }
  if (!start.empty() && pathEnergy(start) <= 2 * direct) {
    start.back() = b;
    auto solved = relaxPath(std::move(start), options);
    if (solved.converged() || solved.termination == Termination::kCancelled) return solved;
  }
  return cascade(a, b, steps, options);
}

Solved<Vertices> GeodesicCalculus::between(const Vertices& a, const Vertices& b, double t,
                                           const GeodesicOptions& options) const {
  const auto from = measure(topology(), a), to = measure(topology(), b);
  ShellObjective objective(structure_, bending());
  const bool symmetric = energy_.symmetry() == EnergySymmetry::kSymmetric;
  const double share = symmetric ? 0.5 : 1;
  objective.addUndeformed(from, share * (1 - t));
  objective.addDeformed(to, share * t);
  if (symmetric) {
    objective.addDeformed(from, share * (1 - t));
    objective.addUndeformed(to, share * t);
  }
  const NewtonOptions newton{options.max_iterations, options.tolerance, options.stop};
  // the minimum is about t (1 - t) W[a, b]; where the straight blend is near it, nothing better is needed
  const Vertices end = aligned(b, a);
  Vertices start = (1 - t) * a + t * end;
  const double straight = objective.value(flatten(start));
  if (!(straight <= 2 * t * (1 - t) * energy_.value(topology(), from, to))) {
    start = reconstruction_->reconstruct(blendMeasures(from, to, t), a, options.stop);
    const Vertices& nearer = t < 0.5 ? a : end;
    if (start.rows() == 0 || !(objective.value(flatten(start)) < objective.value(flatten(nearer)))) start = nearer;
  }
  return minimiseShell(objective, *structure_, start, newton);
}

Solved<Vertices> GeodesicCalculus::through(const Vertices& a, const Vertices& inner, double t,
                                           const GeodesicOptions& options) const {
  if (t == 1) return {inner, Outcome{}};
  if (options.stop.stop_requested()) return {inner, Outcome{Termination::kCancelled, 0, 1}};
  const double rest = (1 - t) / t;
  return solveForDeformed(*structure_, energy_, a, inner, aligned(predict(a, inner, rest, options.stop), inner),
                          options, rest);
}

Vertices GeodesicCalculus::predict(const Vertices& previous, const Vertices& current, double length,
                                   const std::stop_token& stop) const {
  const auto before = measure(topology(), previous), here = measure(topology(), current);
  const double step = length * length * shellEnergy(topology(), before, here, bending());
  const Vertices straight = current + length * (current - aligned(previous, current));
  const double straight_energy = shellEnergy(topology(), here, measure(topology(), straight), bending());
  if (straight_energy < 2 * step) return straight;
  const Vertices curved = reconstruction_->reconstruct(blendMeasures(before, here, 1 + length), current, stop);
  if (curved.rows() > 0) {
    const double curved_energy = shellEnergy(topology(), here, measure(topology(), curved), bending());
    if (curved_energy < straight_energy || !std::isfinite(straight_energy)) return curved;
  }
  return std::isfinite(straight_energy) ? straight : current;
}

Solved<Vertices> GeodesicCalculus::extrapolate(const Vertices& previous, const Vertices& current,
                                               const GeodesicOptions& options) const {
  return solveForDeformed(*structure_, energy_, previous, current, predict(previous, current, 1, options.stop),
                          options);
}

Solved<Vertices> GeodesicCalculus::extrapolateBackwards(const Vertices& current, const Vertices& next,
                                                        const GeodesicOptions& options) const {
  return solveForUndeformed(*structure_, energy_, current, next, predict(next, current, 1, options.stop), options);
}

Solved<Vertices> GeodesicCalculus::at(const Path& path, double t, const GeodesicOptions& options) const {
  if (!std::isfinite(t)) throw InvalidInput("t", "is not a finite number");
  const auto steps = static_cast<std::int64_t>(path.size()) - 1;
  const double position = t * static_cast<double>(steps);
  const double nearest = std::round(position);
  const bool on_node = std::abs(position - nearest) < 1e-12 * std::max(1.0, std::abs(position));
  const auto lower = static_cast<std::int64_t>(on_node ? nearest : std::floor(position));
  const auto upper = on_node ? lower : lower + 1;

  Vertices below = path[static_cast<std::size_t>(std::clamp<std::int64_t>(lower, 0, steps))];
  Vertices above = path[static_cast<std::size_t>(std::clamp<std::int64_t>(upper, 0, steps))];
  Outcome outcome;
  if (upper > steps) {
    Vertices previous = path[static_cast<std::size_t>(steps - 1)];
    below = path.back();
    for (std::int64_t k = steps; k < upper; ++k) {
      auto next = extrapolate(previous, below, options);
      outcome += next;
      previous = std::move(below);
      below = std::move(next.solution);
      if (!outcome.converged()) return {std::move(below), outcome};
    }
    above = std::move(below);
    below = std::move(previous);
  } else if (lower < 0) {
    Vertices next = path[1];
    above = path.front();
    for (std::int64_t k = 0; k > lower; --k) {
      auto previous = extrapolateBackwards(above, next, options);
      outcome += previous;
      next = std::move(above);
      above = std::move(previous.solution);
      if (!outcome.converged()) return {std::move(above), outcome};
    }
    below = std::move(above);
    above = std::move(next);
  }
  if (on_node) return {upper > steps ? std::move(above) : std::move(below), outcome};
  auto inner = between(below, above, position - static_cast<double>(lower), options);
  outcome += inner;
  return {std::move(inner.solution), outcome};
}

Solved<Vertices> GeodesicCalculus::transport(const Path& path, const Vertices& displaced,
                                             const GeodesicOptions& options) const {
  Vertices carried = displaced;
  Outcome outcome;
  for (std::size_t k = 0; k + 1 < path.size() && outcome.converged(); ++k) {
    // the diagonals of a geodesic parallelogram share their midpoint
    const auto centre = between(carried, path[k + 1], 0.5, options);
    outcome += centre;
    auto next = extrapolate(path[k], centre.solution, options);
    outcome += next;
    carried = std::move(next.solution);
  }
  return {std::move(carried), outcome};
}

}  // namespace shaped
