// What fits of a body model to scans and targets take: a creature of 13,000 vertices and 11 modes, a scan of 20,000
// points by the virtual scanner; a fixed seed, one thread. Every answer is checked before it is timed.

#include <benchmark/benchmark.h>

#include "core/body/body_residuals.h"
#include "core/body/body_training.h"
#include "core/mesh/quality.h"
#include "core/registration/scan_registration.h"
#include "core/sample/creature_rig.h"
#include "core/sample/random.h"
#include "core/sample/virtual_scanner.h"

using namespace shaped;

namespace {

constexpr int kVertices = 13000, kIndividuals = 16, kModes = 11;

/// A model of creatures, and one in a pose near rest.
struct Problem {
  BodyModel model;
  BodyState state;
  std::vector<SurfaceTarget> targets;  ///< one a face, along normals, each where the face is
  VirtualScan scan;

  Problem() : model(learned()), state(model.meanState()) {
    Random random(3);
    for (auto& coefficient : state.identity) coefficient = random.normal();
    for (Eigen::Index j = 1; j < state.pose.rotations.rows(); ++j)
      for (int axis = 0; axis < 3; ++axis) state.pose.rotations(j, axis) = 0.05 * random.normal();
    const Vertices body = model.posed(state).vertices();
    const auto& faces = model.topology()->faces();
    for (const auto& face : faces.rowwise()) {
      SurfaceTarget target{{face[0], face[1], face[2]}, Eigen::Vector3d::Constant(1.0 / 3), Eigen::Vector3d::Zero()};
      for (const auto corner : target.corners) target.position += body.row(corner).transpose() / 3;
      target.normal = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      targets.push_back(target);
    }
    scan = scanVirtually(body, faces, scannerFor(boundingBoxDiagonal(body)));
  }

  /// Where the scan has it.
  double errorOf(const Vertices& registered) const {
    return meanVertexDistance(registered, apply(scan.motion, model.posed(state).vertices()));
  }

 private:
  static BodyModel learned() {
    const auto creature = makeCreature({.vertices = kVertices, .proportions = {}});
    std::vector<Vertices> individuals;
    for (int i = 0; i < kIndividuals; ++i)
      individuals.push_back(withProportions(creature, randomProportions(std::uint64_t(i), 0.08)).rest);
    BodyTrainingOptions options;
    options.posture = PostureNormalisation::kNone;
    options.modes = kModes;
    return trainBody(makePostureTemplate(creature.topology, creature.rest, rigOf(creature)), individuals, options)
        ->model;
  }
};

const Problem& problem() {
  static const Problem once;
  return once;
}

void energy(benchmark::State& state) {
  const auto& [model, body, targets, scan] = problem();
  const BodyResiduals residuals(model, targets, {});
  const auto skin = model.posed(body);
  const BodyState mean = model.meanState();
  if (!(residuals.energy(body, skin) < residuals.energy(mean, model.posed(mean))))
    return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(residuals.energy(body, model.posed(body)));
}

void squares(benchmark::State& state) {
  const auto& [model, body, targets, scan] = problem();
  const BodyResiduals residuals(model, targets, {});
  const auto skin = model.posed(body);
  const Eigen::MatrixXd rows = residuals.rows(body, skin), expected = rows.transpose() * rows;
  if (!residuals.squares(body, skin).isApprox(expected, 1e-12)) return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(residuals.squares(body, skin));
}

void registerOne(benchmark::State& state) {
  const auto& [model, body, targets, scan] = problem();
  if (!(problem().errorOf(registerScan(scan.scan, model, {}).solution.vertices) < 5e-3))
    return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(registerScan(scan.scan, model, {}));
}

BENCHMARK(energy)->Name("body fit/energy")->Unit(benchmark::kMillisecond)->MinTime(0.2);
BENCHMARK(squares)->Name("body fit/squares of rows")->Unit(benchmark::kMillisecond)->MinTime(0.2);
BENCHMARK(registerOne)->Name("body fit/register a scan")->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
