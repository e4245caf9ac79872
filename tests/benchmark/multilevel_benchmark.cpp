// Groupwise coarsening to 1000 vertices and prolongation back, on real shapes (the environment variable SHAPED_DATA
// names their folder) and on bent tubes without them; one thread. The even shapes of a set are for training, the odd
// ones are held out, and the errors of prolongate(restrict(x)) on those are reported as counters: in mm, with sets that
// are not in metres scaled to a box diagonal of 1.7 m.

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>

#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/mesh/prolongation.h"
#include "core/mesh/quality.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

enum Set { kTubes, kBodies, kIdentities, kCactus, kCow };

struct Shapes {
  TopologyPtr topology;
  Vertices reference;
  std::vector<Vertices> training, unseen;
  double millimetres;  ///< per unit of the shapes
};

struct Model {
  Shapes shapes;
  Coarsening coarsening;
  std::shared_ptr<const Prolongation> plain, learned;
};

Shapes split(const TopologyPtr& topology, const Vertices& reference, const std::vector<Vertices>& all, double unit) {
  Shapes shapes{topology, reference, {}, {}, unit};
  for (std::size_t s = 0; s < all.size(); ++s) (s % 2 ? shapes.unseen : shapes.training).push_back(all[s]);
  return shapes;
}

Shapes fromFrames(const std::filesystem::path& reference, const std::filesystem::path& frames) {
  const auto file = readMesh(reference);
  const auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(file.vertices.rows()), file.faces);
  return split(topology, file.vertices, readFrames(frames), 1000);
}

Shapes fromMeshes(const std::filesystem::path& reference, const std::string& prefix, const std::string& extension,
                  int first, int last) {
  const auto file = readMesh(reference);
  const auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(file.vertices.rows()), file.faces);
  std::vector<Vertices> all{file.vertices};
  for (int i = first; i <= last; ++i) all.push_back(readMesh(prefix + std::to_string(i) + extension).vertices);
  return split(topology, file.vertices, all, 1700 / boundingBoxDiagonal(file.vertices));
}

Shapes tubes() {
  const auto mesh = tube(200, 60);
  std::vector<Vertices> all;
  for (int i = 0; i < 16; ++i) all.push_back(bend(mesh.vertices, 0.2 * i - 1.5));
  return split(mesh.topology, mesh.vertices, all, 1700 / boundingBoxDiagonal(mesh.vertices));
}

std::optional<Shapes> load(int set) {
  if (set == kTubes) return tubes();
  const char* root = std::getenv("SHAPED_DATA");
  if (!root) return std::nullopt;
  const std::filesystem::path data(root);
  const auto body = data / "posed_body" / "full", identity = data / "body_identities";
  const auto cactus = data / "goast_shapes_mpl2" / "cactus", cow = data / "cragl_characters_mit";
  if (set == kBodies) return fromFrames(body / "template.ply", body / "poses_f32.npy");
  if (set == kIdentities) return fromFrames(identity / "template.ply", identity / "rest_f32.npy");
  if (set == kCactus) return fromMeshes(cactus / "cactus0.ply", (cactus / "cactus").string(), ".ply", 1, 18);
  return fromMeshes(cow / "cow.obj", (cow / "cow" / "cow-").string(), ".obj", 1, 7);
}

/// Loaded and trained once for all benchmarks; null where the data is missing.
const Model* model(int set) {
  static std::map<int, std::optional<Model>> models;
  if (const auto known = models.find(set); known != models.end()) return known->second ? &*known->second : nullptr;
  auto& entry = models[set];
  if (const auto shapes = load(set)) {
    entry.emplace(Model{*shapes, coarsen(shapes->topology, shapes->training), {}, {}});
    entry->plain = Prolongation::learn(shapes->topology, entry->coarsening, shapes->reference, {});
    entry->learned = Prolongation::learn(shapes->topology, entry->coarsening, shapes->reference, shapes->training);
  }
  return entry ? &*entry : nullptr;
}

struct Errors {
  double mean = 0, largest = 0, smallest_area = 1e300, turned = 0;
};

/// turned: triangles that face away from the true ones.
Errors heldOutErrors(const Model& m, const Prolongation& prolongation) {
  Errors errors;
  const auto& faces = m.shapes.topology->faces();
  for (const auto& truth : m.shapes.unseen) {
    const auto fine = prolongation.prolongate(restrictTo(m.coarsening, truth));
    errors.mean += m.shapes.millimetres * meanVertexDistance(fine, truth) / static_cast<double>(m.shapes.unseen.size());
    errors.largest = std::max(errors.largest, m.shapes.millimetres * maxVertexDistance(fine, truth));
    errors.smallest_area = std::min(errors.smallest_area, smallestAreaRatio(faces, truth, fine));
    const auto normals = faceNormals(faces, fine), true_normals = faceNormals(faces, truth);
    errors.turned += static_cast<double>(((normals.array() * true_normals.array()).rowwise().sum() < 0).count());
  }
  return errors;
}

void coarsening(benchmark::State& state) {
  const auto* m = model(static_cast<int>(state.range(0)));
  if (!m) return state.SkipWithError("real data not found; set SHAPED_DATA to its folder");
  std::vector<Vertices> all = m->shapes.training;
  all.insert(all.end(), m->shapes.unseen.begin(), m->shapes.unseen.end());
  Coarsening result;
  for (auto _ : state) result = coarsen(m->shapes.topology, all);
  if (result.coarse->vertexCount() != 1000) return state.SkipWithError("the target was not reached");
  double worst = 1;
  for (const auto& shape : all)
    worst = std::min(worst, triangleQualities(result.coarse->faces(), restrictTo(result, shape)).minCoeff());
  state.counters["shapes"] = static_cast<double>(all.size());
  state.counters["fine"] = m->shapes.topology->vertexCount();
  state.counters["smallest_quality"] = worst;
}

void learning(benchmark::State& state) {
  const auto* m = model(static_cast<int>(state.range(0)));
  if (!m) return state.SkipWithError("real data not found; set SHAPED_DATA to its folder");
  for (auto _ : state) Prolongation::learn(m->shapes.topology, m->coarsening, m->shapes.reference, m->shapes.training);
}

void loading(benchmark::State& state) {
  const auto* m = model(static_cast<int>(state.range(0)));
  if (!m) return state.SkipWithError("real data not found; set SHAPED_DATA to its folder");
  for (auto _ : state) Prolongation(m->shapes.topology, m->coarsening, m->shapes.reference, m->learned->detail());
}

void prolongation(benchmark::State& state, bool learned) {
  const auto* m = model(static_cast<int>(state.range(0)));
  if (!m) return state.SkipWithError("real data not found; set SHAPED_DATA to its folder");
  const auto& map = learned ? *m->learned : *m->plain;
  const auto errors = heldOutErrors(*m, map);
  if (!(errors.mean < 1.5)) return state.SkipWithError("the mean error is above 1.5 mm");
  const auto coarse = restrictTo(m->coarsening, m->shapes.unseen.front());
  for (auto _ : state) benchmark::DoNotOptimize(map.prolongate(coarse));
  state.counters["mean_mm"] = errors.mean;
  state.counters["max_mm"] = errors.largest;
  state.counters["area_ratio"] = errors.smallest_area;
  state.counters["turned"] = errors.turned;
}

void sets(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("set")->DenseRange(kTubes, kCow)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

}  // namespace

BENCHMARK(coarsening)->Name("multilevel/coarsening")->Apply(sets)->Iterations(1);
BENCHMARK(learning)->Name("multilevel/learning")->Apply(sets)->Iterations(1);
BENCHMARK(loading)->Name("multilevel/loading")->Apply(sets)->Iterations(1);
BENCHMARK_CAPTURE(prolongation, plain, false)->Name("multilevel/prolongation_plain")->Apply(sets);
BENCHMARK_CAPTURE(prolongation, learned, true)->Name("multilevel/prolongation_learned")->Apply(sets);
