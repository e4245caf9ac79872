#include "core/shell/shell_objective.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "tests/support/calculus.h"
#include "tests/support/finite_differences.h"
#include "tests/support/literal_forces.h"
#include "tests/support/literal_shell_energy.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Setting {
  Mesh mesh = tube(7, 6);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double eta = 1e-3;
  Vertices a = mesh.vertices, b = bend(mesh.vertices, 1), c = 1.1 * bend(mesh.vertices, -0.5);

  const Topology& topology() const { return *mesh.topology; }
  /// 0.5 W[a, x] + 0.7 W[b, x] + 0.4 W[x, c]
  ShellObjective objective() const {
    ShellObjective result(structure, eta);
    result.addUndeformed(measure(topology(), a), 0.5);
    result.addUndeformed(measure(topology(), b), 0.7);
    result.addDeformed(measure(topology(), c), 0.4);
    return result;
  }
  double literal(const Vertices& x) const {
    return 0.5 * literalShellEnergy(topology(), a, x, eta) + 0.7 * literalShellEnergy(topology(), b, x, eta) +
           0.4 * literalShellEnergy(topology(), x, c, eta);
  }
  double literalImbalance(const Vertices& x) const {
    return relativeImbalance({0.5 * literalSecondForce(topology(), a, x, eta),
                              0.7 * literalSecondForce(topology(), b, x, eta),
                              0.4 * literalFirstForce(topology(), x, c, eta)});
  }
};

}  // namespace

TEST_CASE("the objective's value, gradient and Hessian are those of the literal sum") {
  const Setting s;
  auto objective = s.objective();
  const Vertices x = jitter(bend(s.a, 0.3), 0.03, 1);
  CHECK(objective.value(flatten(x)) == Approx(s.literal(x)).epsilon(1e-9));
  Eigen::VectorXd gradient;
  objective.gradient(flatten(x), gradient);
  const Vertices numeric = differenceGradient([&](const Vertices& y) { return s.literal(y); }, x, 4e-4);
  CHECK((unflatten(gradient) - numeric).norm() < 1e-8 * numeric.norm());

  SymmetricBlockMatrix hessian(s.structure->pattern());
  objective.hessian(flatten(x), false, hessian);
  const Eigen::VectorXd direction = flatten(jitter(Vertices::Zero(x.rows(), 3), 1, 2));
  Eigen::VectorXd product = Eigen::VectorXd::Zero(direction.size()), plus, minus;
  hessian.multiplyAdd(direction.data(), product.data());
  objective.gradient(flatten(x) + 1e-6 * direction, plus);
  objective.gradient(flatten(x) - 1e-6 * direction, minus);
  CHECK((product - (plus - minus) / 2e-6).norm() < 1e-6 * product.norm());
}

TEST_CASE("a pull adds its weight times the squared distances, and fixes the shape in space") {
  const Setting s;
  const Vertices x = jitter(bend(s.a, 0.3), 0.03, 1), points = moveRigidly(s.a, 3);
  auto free = s.objective(), pulled = s.objective();
  pulled.setPull(points, 0.4);
  CHECK(pulled.value(flatten(x)) == Approx(free.value(flatten(x)) + 0.4 * (x - points).squaredNorm()).epsilon(1e-12));
  Eigen::VectorXd gradient, plus, minus;
  pulled.gradient(flatten(x), gradient);
  const Vertices numeric =
      differenceGradient([&](const Vertices& y) { return s.literal(y) + 0.4 * (y - points).squaredNorm(); }, x, 4e-4);
  CHECK((unflatten(gradient) - numeric).norm() < 1e-8 * numeric.norm());
  SymmetricBlockMatrix hessian(s.structure->pattern());
  pulled.hessian(flatten(x), false, hessian);
  const Eigen::VectorXd direction = flatten(jitter(Vertices::Zero(x.rows(), 3), 1, 2));
  Eigen::VectorXd product = Eigen::VectorXd::Zero(direction.size());
  hessian.multiplyAdd(direction.data(), product.data());
  pulled.gradient(flatten(x) + 1e-6 * direction, plus);
  pulled.gradient(flatten(x) - 1e-6 * direction, minus);
  CHECK((product - (plus - minus) / 2e-6).norm() < 1e-6 * product.norm());

  // a rest shape that is pulled to where it lies elsewhere goes there
  ShellObjective rest(s.structure, s.eta);
  rest.addUndeformed(measure(s.topology(), s.a), 1);
  rest.setPull(points, 0.01);
  const auto solved =
      minimiseShell(rest, *s.structure, apply(alignRigidly(bend(s.a, 0.2), points), bend(s.a, 0.2)), {});
  REQUIRE(solved.converged());
  CHECK((solved.solution - points).norm() < 1e-7);
}

TEST_CASE("a converged minimum balances the literal forces however bad the start was") {
  const Setting s;
  const auto good = [&] {
    auto objective = s.objective();
    return minimiseShell(objective, *s.structure, s.a, {});
  }();
  REQUIRE(good.converged());
  CHECK(s.literalImbalance(good.solution) < 2e-8);
  const auto corners = s.topology().faces().row(20);
  for (const double height : {1e-1, 1e-2, 1e-3, 1e-4}) {  // one triangle of the start nearly collapsed
    Vertices start = s.a;
    const Eigen::RowVector3d foot = 0.5 * (start.row(corners[0]) + start.row(corners[1]));
    start.row(corners[2]) = foot + height * (start.row(corners[2]) - foot);
    auto objective = s.objective();
    const auto solved = minimiseShell(objective, *s.structure, start, {});
    INFO("height " << height << ": " << name(solved.termination) << ", residual " << solved.residual);
    REQUIRE(solved.converged());
    CHECK(s.literalImbalance(solved.solution) < 2e-8);
    CHECK(rigidGap(solved.solution, good.solution) < 1e-6);
  }
}

TEST_CASE("where the minimum is at rest the shape itself is found") {
  const Setting s;
  ShellObjective objective(s.structure, s.eta);
  objective.addUndeformed(measure(s.topology(), s.b), 2);
  const auto solved = minimiseShell(objective, *s.structure, jitter(s.b, 0.05, 3), {});
  REQUIRE(solved.converged());
  CHECK(rigidGap(solved.solution, s.b) < 1e-10);
}

TEST_CASE("gauge pins fix six unknowns and change no shape, and given pins are kept") {
  const Setting s;
  auto objective = s.objective();
  const Pins gauge = objective.pins(flatten(s.a));
  int count = 0;
  for (std::size_t i = 0; i < gauge.size(); ++i) count += gauge.pinned(i);
  CHECK(count == 6);
  const auto free = minimiseShell(objective, *s.structure, s.a, {});
  auto moved = s.objective();
  const auto elsewhere = minimiseShell(moved, *s.structure, moveRigidly(s.a, 4), {});
  REQUIRE(elsewhere.converged());
  CHECK(rigidGap(elsewhere.solution, free.solution) < 1e-7);

  auto held = s.objective();
  Pins pins(static_cast<std::int32_t>(s.a.rows()));
  for (const std::int32_t node : {0, 1, 20, 43}) pins.pinAll(node);
  held.setPins(pins);
  const auto solved = minimiseShell(held, *s.structure, s.a, {});
  REQUIRE(solved.converged());
  for (const int node : {0, 1, 20, 43}) CHECK(solved.solution.row(node) == s.a.row(node));
  CHECK(held.value(flatten(solved.solution)) > objective.value(flatten(free.solution)));
}
