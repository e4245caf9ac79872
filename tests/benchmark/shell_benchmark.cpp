// The shell energy and its derivatives on closed tubes, bent by one radian and jittered: a fixed seed, one thread.
// Every quantity starts from the raw positions of both shapes and is checked before it is timed.

#include <benchmark/benchmark.h>

#include <functional>

#include "core/shell/energy.h"
#include "tests/support/literal_shell_energy.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kEta = 1e-3;

/// Two shapes and the workspaces that a solver would keep.
struct Problem {
  TopologyPtr topology;
  ShellStructure structure;
  Vertices s, t;
  ShellMeasures s_measures, t_measures;
  MeasureGradient gradient_in_measures;
  Vertices gradient;
  MeasureCurvature curvature;
  SymmetricBlockMatrix hessian;
  GeneralBlockMatrix mixed;

  Problem(const Mesh& mesh, double noise)
      : topology(mesh.topology),
        structure(mesh.topology),
        s(jitter(mesh.vertices, noise, 1)),
        t(jitter(bend(mesh.vertices, 1), noise, 2)),
        gradient_in_measures(*topology),
        gradient(s.rows(), 3),
        curvature(*topology, HessianKind::kExact),
        hessian(structure.pattern()),
        mixed(structure.pattern()) {}

  void measureBoth() {
    measure(*topology, s, s_measures);
    measure(*topology, t, t_measures);
  }

  double value() {
    measureBoth();
    return shellEnergy(*topology, s_measures, t_measures, kEta);
  }

  void computeGradient(bool first) {
    measureBoth();
    gradient_in_measures.setZero();
    gradient.setZero();
    (first ? addFirstGradient : addSecondGradient)(*topology, s_measures, t_measures, kEta, 1, gradient_in_measures);
    pullBackGradient(*topology, first ? s : t, gradient_in_measures, gradient);
  }

  void computeHessian(bool first, HessianKind kind) {
    measureBoth();
    curvature.reset(kind);
    hessian.setZero();
    (first ? addFirstCurvature : addSecondCurvature)(*topology, s_measures, t_measures, kEta, 1, curvature);
    pullBackHessian(structure, first ? s : t, curvature, hessian);
  }

  void computeMixedHessian() {
    measureBoth();
    mixed.setZero();
    addMixedHessian(structure, s, s_measures, t, t_measures, kEta, 1, mixed);
  }
};

/// About `count` vertices in nearly equilateral triangles, moved by a tenth of an edge.
Problem makeProblem(std::int64_t count) {
  const std::vector<std::array<int, 2>> rings_and_sides{{25, 20}, {50, 40}, {100, 50}, {125, 80}};
  for (const auto& [rings, sides] : rings_and_sides)
    if (rings * sides == count) return {tube(rings, sides), 0.3 / sides};
  throw std::invalid_argument("no tube of this size");
}

bool close(double value, double reference, double tolerance) {
  return std::abs(value - reference) <= tolerance * std::abs(reference);
}

/// One direction for all finite differences.
Vertices direction(const Problem& problem) { return jitter(Vertices::Zero(problem.s.rows(), 3), 1, 3); }

double along(const Vertices& x, const Vertices& y) { return x.cwiseProduct(y).sum(); }

/// Central difference of f in the first or the second shape along d.
template <class F>
auto difference(Problem& problem, bool first, const Vertices& d, const F& f) {
  constexpr double step = 1e-6;
  Vertices& moved = first ? problem.s : problem.t;
  const Vertices start = moved;
  moved = start + step * d;
  const auto plus = f();
  moved = start - step * d;
  const auto minus = f();
  moved = start;
  return std::pair{plus, minus};
}

bool valueIsRight(Problem& problem) {
  return close(problem.value(), literalShellEnergy(*problem.topology, problem.s, problem.t, kEta), 1e-10);
}

bool gradientIsRight(Problem& problem, bool first) {
  const Vertices d = direction(problem);
  const auto [plus, minus] =
      difference(problem, first, d, [&] { return literalShellEnergy(*problem.topology, problem.s, problem.t, kEta); });
  problem.computeGradient(first);
  return close(along(problem.gradient, d), (plus - minus) / 2e-6, 1e-6);
}

/// y = A x against a central difference of the gradient.
bool productIsRight(const Vertices& product, const Vertices& plus, const Vertices& minus) {
  const Vertices expected = (plus - minus) / 2e-6;
  return (product - expected).norm() <= 1e-6 * expected.norm();
}

bool hessianIsRight(Problem& problem, bool first) {
  const Vertices d = direction(problem);
  const auto [plus, minus] = difference(problem, first, d, [&] {
    problem.computeGradient(first);
    return problem.gradient;
  });
  problem.computeHessian(first, HessianKind::kExact);
  Vertices product = Vertices::Zero(d.rows(), 3);
  problem.hessian.multiplyAdd(d.data(), product.data());
  return productIsRight(product, plus, minus);
}

bool mixedHessianIsRight(Problem& problem) {
  const Vertices d = direction(problem);
  const auto [plus, minus] = difference(problem, false, d, [&] {
    problem.computeGradient(true);
    return problem.gradient;
  });
  problem.computeMixedHessian();
  Vertices product = Vertices::Zero(d.rows(), 3);
  problem.mixed.multiplyAdd(1, d.data(), product.data());
  return productIsRight(product, plus, minus);
}

/// Times `body` on a problem that passes `check`.
template <class Check, class Body>
void run(benchmark::State& state, const Check& check, const Body& body) {
  auto problem = makeProblem(state.range(0));
  if (!check(problem)) return state.SkipWithError("the result is wrong");
  body(problem);  // the first call sizes the workspaces
  for (auto _ : state) {
    body(problem);
    benchmark::ClobberMemory();
  }
}

void energy(benchmark::State& state) {
  run(state, valueIsRight, [](Problem& p) { benchmark::DoNotOptimize(p.value()); });
}
void firstGradient(benchmark::State& state) {
  run(
      state, [](Problem& p) { return gradientIsRight(p, true); }, [](Problem& p) { p.computeGradient(true); });
}
void secondGradient(benchmark::State& state) {
  run(
      state, [](Problem& p) { return gradientIsRight(p, false); }, [](Problem& p) { p.computeGradient(false); });
}
void firstHessian(benchmark::State& state) {
  run(
      state, [](Problem& p) { return hessianIsRight(p, true); },
      [](Problem& p) { p.computeHessian(true, HessianKind::kExact); });
}
void secondHessian(benchmark::State& state) {
  run(
      state, [](Problem& p) { return hessianIsRight(p, false); },
      [](Problem& p) { p.computeHessian(false, HessianKind::kExact); });
}
void secondHessianProjected(benchmark::State& state) {
  run(
      state, [](Problem& p) { return hessianIsRight(p, false); },
      [](Problem& p) { p.computeHessian(false, HessianKind::kProjected); });
}
void mixedHessian(benchmark::State& state) {
  run(state, mixedHessianIsRight, [](Problem& p) { p.computeMixedHessian(); });
}

/// A definite Hessian (that of the undeformed shape) and its factor, for the linear algebra on it.
struct LinearProblem {
  Problem problem;
  Pins pins;
  CholeskyFactor factor;
  Eigen::VectorXd x, y;

  explicit LinearProblem(std::int64_t count)
      : problem(makeProblem(count)), pins(gaugePins(problem.s)), factor(problem.structure.analysis()) {
    problem.t = problem.s;
    problem.computeHessian(false, HessianKind::kExact);
    problem.computeMixedHessian();
    x = Eigen::Map<const Eigen::VectorXd>(direction(problem).data(), problem.s.size());
    pins.clear(x.data());
    y.setZero(x.size());
  }

  /// At rest W,12 = -W,22, and the factor undoes the product.
  bool isRight() {
    if (!factor.factorise(problem.hessian, pins)) return false;
    Eigen::VectorXd product = Eigen::VectorXd::Zero(x.size()), negative = product;
    problem.hessian.multiplyAdd(x.data(), product.data());
    problem.mixed.multiplyAdd(-1, x.data(), negative.data());
    if ((product - negative).norm() > 1e-10 * product.norm()) return false;
    problem.mixed.multiplyTransposedAdd(1, x.data(), negative.data());
    if (negative.norm() > 1e-10 * product.norm()) return false;
    pins.clear(product.data());
    factor.solve(product.data(), y.data());
    return (y - x).norm() <= 1e-8 * x.norm();
  }
};

template <class Body>
void runLinear(benchmark::State& state, const Body& body) {
  LinearProblem linear(state.range(0));
  if (!linear.isRight()) return state.SkipWithError("the result is wrong");
  for (auto _ : state) {
    body(linear);
    benchmark::ClobberMemory();
  }
}

void symmetricProduct(benchmark::State& state) {
  runLinear(state, [](LinearProblem& l) { l.problem.hessian.multiplyAdd(l.x.data(), l.y.data()); });
}
void generalProduct(benchmark::State& state) {
  runLinear(state, [](LinearProblem& l) { l.problem.mixed.multiplyAdd(1, l.x.data(), l.y.data()); });
}
void generalTransposedProduct(benchmark::State& state) {
  runLinear(state, [](LinearProblem& l) { l.problem.mixed.multiplyTransposedAdd(1, l.x.data(), l.y.data()); });
}
void factorise(benchmark::State& state) {
  runLinear(state, [](LinearProblem& l) { benchmark::DoNotOptimize(l.factor.factorise(l.problem.hessian, l.pins)); });
}
void solve(benchmark::State& state) {
  runLinear(state, [](LinearProblem& l) { l.factor.solve(l.x.data(), l.y.data()); });
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int count : {500, 2000, 5000, 10000}) benchmark->Arg(count);
  benchmark->Unit(benchmark::kMillisecond)->MinTime(0.2);
}

BENCHMARK(energy)->Name("shell/W")->Apply(sizes);
BENCHMARK(firstGradient)->Name("shell/W,1")->Apply(sizes);
BENCHMARK(secondGradient)->Name("shell/W,2")->Apply(sizes);
BENCHMARK(firstHessian)->Name("shell/W,11")->Apply(sizes);
BENCHMARK(secondHessian)->Name("shell/W,22")->Apply(sizes);
BENCHMARK(secondHessianProjected)->Name("shell/W,22 projected")->Apply(sizes);
BENCHMARK(mixedHessian)->Name("shell/W,12")->Apply(sizes);
BENCHMARK(symmetricProduct)->Name("blocks/symmetric product")->Apply(sizes);
BENCHMARK(generalProduct)->Name("blocks/general product")->Apply(sizes);
BENCHMARK(generalTransposedProduct)->Name("blocks/transposed product")->Apply(sizes);
BENCHMARK(factorise)->Name("cholesky/factorise")->Apply(sizes);
BENCHMARK(solve)->Name("cholesky/solve")->Apply(sizes);

}  // namespace
