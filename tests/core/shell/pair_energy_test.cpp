#include "core/shell/pair_energy.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/support/finite_differences.h"
#include "tests/support/literal_shell_energy.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kEta = 0.02;

/// Two tubes that are bent and stretched differently.
struct Pair {
  Mesh mesh = tube(4, 5);
  Vertices a = jitter(bend(mesh.vertices, 0.7), 0.04, 1);
  Vertices b = jitter(1.2 * bend(mesh.vertices, -0.4), 0.04, 2);

  ShellMeasures of(const Vertices& shape) const { return measure(*mesh.topology, shape); }

  double value(EnergySymmetry symmetry, const Vertices& from, const Vertices& to) const {
    return PairEnergy(kEta, symmetry).value(*mesh.topology, of(from), of(to));
  }

  /// Derivative in the first or the second shape.
  Eigen::VectorXd gradient(EnergySymmetry symmetry, const Vertices& from, const Vertices& to, bool first) const {
    const PairEnergy energy(kEta, symmetry);
    MeasureGradient measures(*mesh.topology);
    if (first)
      energy.addFirstGradient(*mesh.topology, of(from), of(to), 1, measures);
    else
      energy.addSecondGradient(*mesh.topology, of(from), of(to), 1, measures);
    Vertices result = Vertices::Zero(from.rows(), 3);
    pullBackGradient(*mesh.topology, first ? from : to, measures, result);
    return Eigen::Map<const Eigen::VectorXd>(result.data(), result.size());
  }
};

double relativeGap(const Eigen::MatrixXd& value, const Eigen::MatrixXd& reference) {
  return (value - reference).norm() / reference.norm();
}

}  // namespace

TEST_CASE("the symmetric pair energy is the mean of W over its directions; the directed one is W") {
  const Pair pair;
  const double forth = literalShellEnergy(*pair.mesh.topology, pair.a, pair.b, kEta);
  const double back = literalShellEnergy(*pair.mesh.topology, pair.b, pair.a, kEta);
  REQUIRE(std::abs(forth / back - 1) > 1e-2);  // the control
  CHECK(pair.value(EnergySymmetry::kSymmetric, pair.a, pair.b) == Approx(0.5 * (forth + back)).epsilon(1e-9));
  CHECK(pair.value(EnergySymmetry::kSymmetric, pair.b, pair.a) ==
        Approx(pair.value(EnergySymmetry::kSymmetric, pair.a, pair.b)).epsilon(1e-14));
  CHECK(pair.value(EnergySymmetry::kDirected, pair.a, pair.b) == Approx(forth).epsilon(1e-9));
}

TEST_CASE("pair energy gradients and Hessians match central differences") {
  const Pair pair;
  const ShellStructure structure(pair.mesh.topology);
  for (const auto symmetry : {EnergySymmetry::kSymmetric, EnergySymmetry::kDirected}) {
    const auto value = [&](const Vertices& a, const Vertices& b) {
      return Eigen::VectorXd::Constant(1, pair.value(symmetry, a, b));
    };
    const auto gradient = [&](const Vertices& a, const Vertices& b, bool first) {
      return pair.gradient(symmetry, a, b, first);
    };
    const auto by_a = differenceJacobian([&](const Vertices& x) { return value(x, pair.b); }, pair.a, 1e-6);
    const auto by_b = differenceJacobian([&](const Vertices& x) { return value(pair.a, x); }, pair.b, 1e-6);
    CHECK(relativeGap(gradient(pair.a, pair.b, true).transpose(), by_a) < 1e-7);
    CHECK(relativeGap(gradient(pair.a, pair.b, false).transpose(), by_b) < 1e-7);

    const PairEnergy energy(kEta, symmetry);
    for (const bool first : {true, false}) {
      MeasureCurvature curvature(*pair.mesh.topology, HessianKind::kExact);
      SymmetricBlockMatrix hessian(structure.pattern());
      if (first)
        energy.addFirstCurvature(*pair.mesh.topology, pair.of(pair.a), pair.of(pair.b), 1, curvature);
      else
        energy.addSecondCurvature(*pair.mesh.topology, pair.of(pair.a), pair.of(pair.b), 1, curvature);
      pullBackHessian(structure, first ? pair.a : pair.b, curvature, hessian);
      const auto expected = differenceJacobian(
          [&](const Vertices& x) { return first ? gradient(x, pair.b, true) : gradient(pair.a, x, false); },
          first ? pair.a : pair.b, 1e-6);
      CHECK(relativeGap(Eigen::MatrixXd(hessian.toSparse()), expected) < 1e-6);
    }
    GeneralBlockMatrix mixed(structure.pattern());
    energy.addMixedHessian(structure, pair.a, pair.of(pair.a), pair.b, pair.of(pair.b), 1, mixed);
    const auto expected =
        differenceJacobian([&](const Vertices& x) { return gradient(pair.a, x, true); }, pair.b, 1e-6);
    CHECK(relativeGap(Eigen::MatrixXd(mixed.toSparse()), expected) < 1e-6);
  }
}

TEST_CASE("the symmetric energy agrees with its metric to fourth order, W to third") {
  // along s + t u: D = t^2 g + O(t^4) where the metric is taken in the middle, W = t^2 g + O(t^3)
  const Pair pair;
  const Vertices u = jitter(Vertices::Zero(pair.a.rows(), 3), 1, 3);
  const auto excess = [&](EnergySymmetry symmetry, double t) {
    const Vertices from = pair.a - 0.5 * t * u, to = pair.a + 0.5 * t * u;
    const double tiny = 1e-3;
    const double metric = pair.value(symmetry, pair.a - 0.5 * tiny * u, pair.a + 0.5 * tiny * u) / (tiny * tiny);
    return std::abs(pair.value(symmetry, from, to) / (t * t) - metric) / metric;
  };
  for (const double t : {0.02, 0.01}) {
    const double symmetric_order =
        std::log2(excess(EnergySymmetry::kSymmetric, t) / excess(EnergySymmetry::kSymmetric, t / 2));
    const double directed_order =
        std::log2(excess(EnergySymmetry::kDirected, t) / excess(EnergySymmetry::kDirected, t / 2));
    CHECK(symmetric_order == Approx(2).margin(0.2));
    CHECK(directed_order == Approx(1).margin(0.3));
  }
}
