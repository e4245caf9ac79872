// Discrete K = 4 geodesics on one thread: a tube bent by two radians, and cactus0 -> cactus2 of the real data, whole
// and coarsened, when the environment variable SHAPED_DATA names its folder. The work that is shared by all geodesics
// of one topology (ordering, symbolic factorisation) is timed by itself.

#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "core/geodesic/geodesic.h"
#include "core/io/mesh_file.h"
#include "core/mesh/coarsening.h"
#include "core/shell/energy.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr int kSteps = 4;

struct Ends {
  TopologyPtr topology;
  Vertices a, b;
  double bending;
  double highest_energy;  ///< a geodesic's path energy is not above it
};

Ends tubeEnds(int rings, int sides) {
  const auto mesh = tube(rings, sides);
  const Vertices bent = jitter(bend(mesh.vertices, 2), 0.1 / sides, 1);
  const double bending = defaultBending(mesh.vertices);
  const double direct = shellEnergy(*mesh.topology, mesh.vertices, bent, bending);
  return {mesh.topology, mesh.vertices, bent, bending, 1.2 * direct};
}

std::optional<std::filesystem::path> cactusFolder() {
  const char* root = std::getenv("SHAPED_DATA");
  if (!root) return std::nullopt;
  auto folder = std::filesystem::path(root) / "goast_shapes_mpl2" / "cactus";
  return std::filesystem::exists(folder) ? std::optional(folder) : std::nullopt;
}

/// cactus0 and cactus2 with `count` vertices; the whole mesh has 5261. A public library ends at a path energy of
/// 0.0296957 on it.
std::optional<Ends> cactusEnds(int count) {
  const auto folder = cactusFolder();
  if (!folder) return std::nullopt;
  const auto a = readMesh(*folder / "cactus0.ply"), b = readMesh(*folder / "cactus2.ply");
  auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(a.vertices.rows()), a.faces);
  constexpr double eta = 1e-3;
  if (count == a.vertices.rows()) return Ends{topology, a.vertices, b.vertices, eta, 0.0296957};
  CoarseningOptions options;
  options.vertex_count = count;
  const auto coarse = coarsen(topology, {a.vertices, b.vertices}, options);
  const Vertices from = restrictTo(coarse, a.vertices), to = restrictTo(coarse, b.vertices);
  return Ends{coarse.coarse, from, to, eta, 1.2 * shellEnergy(*coarse.coarse, from, to, eta)};
}

/// Converged, of constant speed and not above the energy that is known to be reachable.
bool isRight(const GeodesicCalculus& calculus, const Ends& ends, const Solved<Path>& geodesic) {
  const auto speeds = calculus.segmentEnergies(geodesic.solution);
  const auto [slowest, fastest] = std::minmax_element(speeds.begin(), speeds.end());
  return geodesic.converged() && *fastest < 1.2 * *slowest &&
         calculus.pathEnergy(geodesic.solution) <= ends.highest_energy * (1 + 1e-6);
}

void timeGeodesic(benchmark::State& state, const Ends& ends) {
  tbb::task_arena one_thread(1);
  one_thread.execute([&] {
    const GeodesicCalculus calculus(std::make_shared<ShellStructure>(ends.topology), ends.bending);
    Solved<Path> geodesic;
    for (auto _ : state) geodesic = calculus.interpolate(ends.a, ends.b, kSteps, {});
    if (!isRight(calculus, ends, geodesic)) state.SkipWithError("no geodesic of constant speed was found");
    state.counters["iterations"] = geodesic.iterations;
    state.counters["residual"] = geodesic.residual;
    state.counters["path_energy"] = calculus.pathEnergy(geodesic.solution);
  });
}

void tubeGeodesic(benchmark::State& state) {
  timeGeodesic(state, state.range(0) == 500 ? tubeEnds(25, 20) : tubeEnds(50, 40));
}

void cactusGeodesic(benchmark::State& state) {
  if (const auto ends = cactusEnds(static_cast<int>(state.range(0))))
    timeGeodesic(state, *ends);
  else
    state.SkipWithError("needs the real data: set SHAPED_DATA to its folder");
}

void analysis(benchmark::State& state) {
  const auto ends = tubeEnds(50, 40);
  for (auto _ : state) {
    const GeodesicCalculus calculus(std::make_shared<ShellStructure>(ends.topology), ends.bending);
    benchmark::DoNotOptimize(&calculus);
  }
}

BENCHMARK(tubeGeodesic)->Name("geodesic/tube")->Arg(500)->Arg(2000)->Unit(benchmark::kMillisecond);
BENCHMARK(cactusGeodesic)->Name("geodesic/cactus")->Arg(500)->Arg(2000)->Arg(5261)->Unit(benchmark::kMillisecond);
BENCHMARK(analysis)->Name("geodesic/analysis of 2000 vertices")->Unit(benchmark::kMillisecond);

}  // namespace
