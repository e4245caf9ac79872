#include "core/shell/energy.h"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "tests/support/finite_differences.h"
#include "tests/support/literal_shell_energy.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kEta = 3e-3;

struct Pair {
  std::string name;
  Mesh mesh;
  Vertices s, t;
};

/// Compressed, at rest, stretched; flat, folded; with and without boundary.
std::vector<Pair> regimes() {
  const auto sphere = icosphere(1);
  const auto sheet = grid(4);
  const auto pipe = tube(7, 6);
  Vertices folded = sheet.vertices;
  for (Eigen::Index v = 0; v < folded.rows(); ++v)
    if (folded(v, 0) > 0.5) folded(v, 2) = 1.5 * (folded(v, 0) - 0.5), folded(v, 0) = 1 - 0.9 * folded(v, 0);
  return {{"rest", sphere, sphere.vertices, sphere.vertices},
          {"jittered", sphere, jitter(sphere.vertices, 0.1, 1), jitter(sphere.vertices, 0.1, 2)},
          {"compressed", sphere, jitter(sphere.vertices, 0.05, 3), 0.4 * jitter(sphere.vertices, 0.05, 4)},
          {"stretched", sphere, jitter(sphere.vertices, 0.05, 5), 2.5 * jitter(sphere.vertices, 0.05, 6)},
          {"flat to flat", sheet, sheet.vertices, 1.1 * sheet.vertices},
          {"flat to folded", sheet, jitter(sheet.vertices, 0.02, 7), jitter(folded, 0.02, 8)},
          {"folded to flat", sheet, jitter(folded, 0.02, 9), jitter(sheet.vertices, 0.02, 10)},
          {"bent", pipe, jitter(pipe.vertices, 0.02, 11), jitter(bend(pipe.vertices, 2), 0.02, 12)}};
}

Eigen::Map<const Eigen::VectorXd> flat(const Vertices& v) { return {v.data(), v.size()}; }

Vertices gradientOf(const Mesh& mesh, const Vertices& s, const Vertices& t, bool first) {
  const auto& topology = *mesh.topology;
  MeasureGradient g(topology);
  (first ? addFirstGradient : addSecondGradient)(topology, measure(topology, s), measure(topology, t), kEta, 1, g);
  Vertices result = Vertices::Zero(s.rows(), 3);
  pullBackGradient(topology, first ? s : t, g, result);
  return result;
}

Eigen::MatrixXd hessianOf(const ShellStructure& structure, const Vertices& s, const Vertices& t, bool first,
                          HessianKind kind = HessianKind::kExact) {
  const auto& topology = structure.topology();
  MeasureCurvature curvature(topology, kind);
  (first ? addFirstCurvature : addSecondCurvature)(topology, measure(topology, s), measure(topology, t), kEta, 1,
                                                   curvature);
  SymmetricBlockMatrix hessian(structure.pattern());
  pullBackHessian(structure, first ? s : t, curvature, hessian);
  return Eigen::MatrixXd(hessian.toSparse());
}

Eigen::MatrixXd mixedOf(const ShellStructure& structure, const Vertices& s, const Vertices& t) {
  GeneralBlockMatrix matrix(structure.pattern());
  addMixedHessian(structure, s, measure(structure.topology(), s), t, measure(structure.topology(), t), kEta, 1, matrix);
  return Eigen::MatrixXd(matrix.toSparse());
}

double relativeError(const Eigen::MatrixXd& value, const Eigen::MatrixXd& reference, double floor) {
  return (value - reference).norm() / std::max(reference.norm(), floor);
}

}  // namespace

TEST_CASE("the shell energy equals a literal evaluation with strain matrices and arc cosines") {
  for (const auto& [name, mesh, s, t] : regimes()) {
    INFO(name);
    const double literal = literalShellEnergy(*mesh.topology, s, t, kEta);
    CHECK(shellEnergy(*mesh.topology, s, t, kEta) == Approx(literal).epsilon(1e-9).margin(1e-12));
  }
}

TEST_CASE("shell gradients match central differences in both arguments") {
  for (const auto& [name, mesh, s, t] : regimes()) {
    INFO(name);
    const auto value = [&mesh = mesh](const Vertices& a, const Vertices& b) {
      return Eigen::VectorXd::Constant(1, shellEnergy(*mesh.topology, a, b, kEta));
    };
    const auto first = differenceJacobian([&, &t = t](const Vertices& x) { return value(x, t); }, s, 1e-6);
    const auto second = differenceJacobian([&, &s = s](const Vertices& x) { return value(s, x); }, t, 1e-6);
    CHECK(relativeError(flat(gradientOf(mesh, s, t, true)).transpose(), first, 1) < 1e-7);
    CHECK(relativeError(flat(gradientOf(mesh, s, t, false)).transpose(), second, 1) < 1e-7);
  }
}

TEST_CASE("shell Hessians match central differences of the gradients: first, second and mixed") {
  for (const auto& [name, mesh, s, t] : regimes()) {
    INFO(name);
    const ShellStructure structure(mesh.topology);
    const auto gradient = [&mesh = mesh](const Vertices& a, const Vertices& b, bool first) {
      return Eigen::VectorXd(flat(gradientOf(mesh, a, b, first)));
    };
    const auto first = differenceJacobian([&, &t = t](const Vertices& x) { return gradient(x, t, true); }, s, 1e-6);
    const auto second = differenceJacobian([&, &s = s](const Vertices& x) { return gradient(s, x, false); }, t, 1e-6);
    const auto mixed = differenceJacobian([&, &s = s](const Vertices& x) { return gradient(s, x, true); }, t, 1e-6);
    CHECK(relativeError(hessianOf(structure, s, t, true), first, 1) < 1e-6);
    CHECK(relativeError(hessianOf(structure, s, t, false), second, 1) < 1e-6);
    CHECK(relativeError(mixedOf(structure, s, t), mixed, 1) < 1e-6);
  }
}

TEST_CASE("projected Hessians are positive semi-definite and at rest equal the exact ones") {
  for (const auto& [name, mesh, s, t] : regimes()) {
    INFO(name);
    const ShellStructure structure(mesh.topology);
    for (const bool first : {true, false}) {
      const auto projected = hessianOf(structure, s, t, first, HessianKind::kProjected);
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(projected, Eigen::EigenvaluesOnly);
      CHECK(eigen.eigenvalues().minCoeff() > -1e-10 * eigen.eigenvalues().maxCoeff());
      if (name == "rest") CHECK(relativeError(projected, hessianOf(structure, s, t, first), 1) < 1e-10);
    }
  }
}

TEST_CASE("the energy vanishes at rest, ignores rigid motions of either shape, and scales with area") {
  for (const auto& [name, mesh, s, t] : regimes()) {
    INFO(name);
    const auto& topology = *mesh.topology;
    const double energy = shellEnergy(topology, s, t, kEta);
    CHECK(shellEnergy(topology, s, s, kEta) == Approx(0).margin(1e-12));
    CHECK(shellEnergy(topology, moveRigidly(s, 1), moveRigidly(t, 2), kEta) ==
          Approx(energy).epsilon(1e-9).margin(1e-12));
    CHECK(shellEnergy(topology, 3 * s, 3 * t, 9 * kEta) == Approx(9 * energy).epsilon(1e-9).margin(1e-12));
    CHECK(shellEnergy(topology, s, 1.2 * t, kEta) != Approx(energy).epsilon(1e-3));  // the control: scaling one counts
  }
}

TEST_CASE("closed forms: uniform scaling of a sheet, and a developable fold") {
  const auto sheet = grid(5);
  const double r = 1.3;  // G = r^2 I on area 1
  const double expected = r * r + 0.25 * std::pow(r, 4) - 0.75 * std::log(std::pow(r, 4)) - 1.25;
  CHECK(shellEnergy(*sheet.topology, sheet.vertices, r * sheet.vertices, kEta) == Approx(expected).epsilon(1e-12));

  Vertices folded = sheet.vertices;  // along the line x = 1/2 by 90 degrees: no stretch
  for (Eigen::Index v = 0; v < folded.rows(); ++v)
    if (folded(v, 0) > 0.5) folded(v, 2) = folded(v, 0) - 0.5, folded(v, 0) = 0.5;
  const auto parts =
      shellEnergyParts(*sheet.topology, measure(*sheet.topology, sheet.vertices), measure(*sheet.topology, folded));
  CHECK(parts.membrane == Approx(0).margin(1e-14));
  const double right = 3.14159265358979323846 / 2;
  CHECK(parts.bending_over_eta ==
        Approx(4 * right * right * (0.0625 / 0.0625)).epsilon(1e-12));  // 4 edges, l = 1/16, S = 1/16
}

TEST_CASE("a collapsed triangle costs infinite energy in either place") {
  const auto sheet = grid(3);
  Vertices collapsed = sheet.vertices;
  collapsed.row(0) = collapsed.row(1);
  CHECK(std::isinf(shellEnergy(*sheet.topology, sheet.vertices, collapsed, kEta)));
  CHECK(std::isinf(shellEnergy(*sheet.topology, collapsed, sheet.vertices, kEta)));
}
