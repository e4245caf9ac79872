// What a neural Jacobian field asks of a surface, on closed tubes, bent and jittered, the largest with the 13,380
// vertices of a full body: a fixed seed, one thread. Every answer is checked before it is timed.

#include <benchmark/benchmark.h>

#include "core/neural/jacobian_poisson.h"
#include "core/surface/laplacian.h"
#include "core/surface/wave_kernel_signature.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Mesh body(std::int64_t count) {
  const auto mesh = count == 13380 ? tube(223, 60) : tube(50, 40);
  return {mesh.topology, jitter(mesh.vertices, 1e-3, 1)};
}

/// A solver, a shape that is not its source, and what the shape has to come back from.
struct Problem {
  Mesh mesh;
  Vertices shape;
  std::shared_ptr<const JacobianPoisson> poisson;
  Jacobians jacobians;

  explicit Problem(std::int64_t count)
      : mesh(body(count)),
        shape(jitter(bend(mesh.vertices, 1), 0.01, 2)),
        poisson(JacobianPoisson::make(mesh.topology, mesh.vertices)),
        jacobians(poisson->jacobians(shape)) {}

  bool isRight() const {
    const Vertices back = poisson->solve(jacobians, poisson->centroids(shape));
    const Vertices moved = poisson->solve(jacobians) - poisson->solve(Jacobians::Zero(jacobians.rows(), 9));
    const double forward = moved.cwiseProduct(shape).sum();
    const double transposed = jacobians.cwiseProduct(poisson->backward(shape)).sum();
    return (back - shape).cwiseAbs().maxCoeff() < 1e-9 && std::abs(forward - transposed) < 1e-9 * std::abs(forward);
  }
};

template <class Body>
void run(benchmark::State& state, const Body& body) {
  const Problem problem(state.range(0));
  if (!problem.isRight()) return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(body(problem));
}

void make(benchmark::State& state) {
  run(state, [](const Problem& p) { return JacobianPoisson::make(p.mesh.topology, p.mesh.vertices); });
}
void solve(benchmark::State& state) {
  run(state, [](const Problem& p) { return p.poisson->solve(p.jacobians); });
}
void backward(benchmark::State& state) {
  run(state, [](const Problem& p) { return p.poisson->backward(p.shape); });
}
void jacobians(benchmark::State& state) {
  run(state, [](const Problem& p) { return p.poisson->jacobians(p.shape); });
}

bool spectrumIsRight(const Mesh& mesh, const Solved<SurfaceSpectrum>& solved) {
  const auto& [values, functions, areas] = solved.solution;
  if (!solved.converged() || values.size() != 100) return false;
  const Eigen::MatrixXd gram = functions.transpose() * areas.asDiagonal() * functions;
  const Eigen::MatrixXd forces = cotangentStiffness(mesh.vertices, mesh.topology->faces()) * functions;
  return gram.isIdentity(1e-9) &&
         (forces - areas.asDiagonal() * functions * values.asDiagonal()).norm() < 1e-8 * forces.norm();
}

void spectrum(benchmark::State& state) {
  const auto mesh = body(state.range(0));
  if (!spectrumIsRight(mesh, surfaceSpectrum(*mesh.topology, mesh.vertices)))
    return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(surfaceSpectrum(*mesh.topology, mesh.vertices));
}

void signature(benchmark::State& state) {
  const auto mesh = body(state.range(0));
  const auto solved = surfaceSpectrum(*mesh.topology, mesh.vertices);
  const Eigen::VectorXd means = waveKernelSignature(solved.solution).transpose() * solved.solution.areas;
  if (!spectrumIsRight(mesh, solved) || !means.isConstant(solved.solution.areas.sum(), 1e-9))
    return state.SkipWithError("the result is wrong");
  for (auto _ : state) benchmark::DoNotOptimize(waveKernelSignature(solved.solution));
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(2000)->Arg(13380)->Unit(benchmark::kMillisecond)->MinTime(0.2);
}

BENCHMARK(make)->Name("jacobian field/factorise")->Apply(sizes);
BENCHMARK(solve)->Name("jacobian field/solve")->Apply(sizes);
BENCHMARK(backward)->Name("jacobian field/backward")->Apply(sizes);
BENCHMARK(jacobians)->Name("jacobian field/Jacobians")->Apply(sizes);
BENCHMARK(spectrum)->Name("surface/100 eigenpairs")->Apply(sizes);
BENCHMARK(signature)->Name("surface/wave kernel signature")->Apply(sizes);

}  // namespace
