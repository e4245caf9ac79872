#include "core/curve/reduced_curve.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "core/curve/reduced_average.h"
#include "core/mesh/quality.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const Mesh& pipe() {
  static const Mesh mesh = tube(30, 10);
  return mesh;
}
double bending() { return defaultBending(pipe().vertices); }

/// Bends to and fro while it grows thicker and thinner, turning in space, with trembling of every other frame.
Curve wavingCurve(int frames) {
  Curve curve{{}, false};
  for (int i = 0; i < frames; ++i) {
    const double phase = 3.14159265358979 * i / (frames - 1.0);
    Vertices shape = pipe().vertices;
    shape.col(2) *= 1 + 0.15 * std::sin(2 * phase);
    shape = bend(shape, 1.1 * std::sin(phase) + (i % 2 == 1 ? 0.06 : 0));
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5 * phase, Eigen::Vector3d::UnitY()).toRotationMatrix();
    shape = shape * turn.transpose();
    shape.col(0).array() += 0.3 * i;
    curve.frames.push_back(shape);
  }
  return curve;
}

/// Goes along a geodesic, every other frame too far.
Curve tremblingCurve() {
  const GeodesicCalculus calculus(std::make_shared<const ShellStructure>(pipe().topology),
                                  PairEnergy(bending(), EnergySymmetry::kSymmetric));
  const auto path = calculus.interpolate(pipe().vertices, bend(pipe().vertices, 0.9), 30, {100, 1e-8, {}});
  Curve curve{{}, false};
  for (std::size_t k = 0; k <= 30; k += 2)
    curve.frames.push_back(
        moveRigidly(path.solution[std::min<std::size_t>(30, k + (k % 4 == 2 ? 2 : 0))], static_cast<unsigned>(k)));
  return curve;
}

Eigen::MatrixXd randomBasis(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random) / std::sqrt(double(rows)); });
}

}  // namespace

TEST_CASE("gradient and Hessian of a reduced average agree with differences") {
  const auto mesh = tube(8, 6);
  const std::vector<Vertices> shapes{bend(mesh.vertices, 0.4), jitter(mesh.vertices, 0.02, 1), mesh.vertices};
  std::vector<ShellMeasures> measures;
  for (const auto& shape : shapes) measures.push_back(measure(*mesh.topology, shape));
  const std::vector<AverageTerm> terms{{&measures[0], 0.5}, {&measures[1], 1.2}, {&measures[2], 0.8}};
  const GhostSpace shared(mesh.topology, {mesh.vertices, randomBasis(mesh.vertices.size(), 4, 3)}, {mesh.vertices},
                          1000);
  const FrameSpace space{&shared, randomBasis(mesh.vertices.size(), 1, 4)};
  for (const auto symmetry : {EnergySymmetry::kDirected, EnergySymmetry::kSymmetric}) {
    const PairEnergy energy(defaultBending(mesh.vertices), symmetry);
    ReducedAverage average(space, energy, terms, {0.02 * Eigen::VectorXd::Random(5), 0.3});
    const Eigen::VectorXd q = 0.03 * Eigen::VectorXd::Random(5);
    Eigen::VectorXd gradient(5), unused(5), above(5), below(5);
    average(q, gradient);
    for (int j = 0; j < 5; ++j) {
      const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(5, j);
      CHECK((average(q + step, unused) - average(q - step, unused)) / 2e-5 ==
            Approx(gradient[j]).epsilon(1e-6).margin(1e-8 * gradient.norm()));
    }
    // at rest no element is indefinite, and the Hessian is exact
    ReducedAverage rest(space, energy, {{&measures[2], 2.0}}, {0.02 * Eigen::VectorXd::Random(5), 0.3});
    const auto hessian = rest.hessian(Eigen::VectorXd::Zero(5));
    for (int j = 0; j < 5; ++j) {
      const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(5, j);
      rest(step, above);
      rest(-step, below);
      CHECK(((above - below) / 2e-5 - hessian.col(j)).norm() < 1e-5 * hessian.norm());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(average.hessian(q));
    CHECK(eigen.eigenvalues()[0] > 0);
  }
}

TEST_CASE("a reduced curve holds its frames where they are, whatever its dimension and ghost mesh") {
  for (const auto& [frames, dimension, ghost] :
       {std::tuple{9, 2, 60}, std::tuple{9, 4, 302}, std::tuple{9, 40, 150}, std::tuple{20, 5, 150}}) {
    const auto curve = wavingCurve(frames);
    const ReducedCurve reduced(pipe().topology, bending(), curve, {.dimension = dimension, .ghost_vertices = ghost});
    const int tangents = frames < 20 ? frames - 2 : 0;
    const int principal = std::min(dimension, frames - 1);
    CHECK(reduced.space().dimension() <= principal + tangents);
    CHECK(reduced.space().dimension() > (tangents > 0 ? principal : principal - 1));
    CHECK(reduced.space().topology()->vertexCount() <= ghost);
    const auto flow = reduced.flow({});
    for (std::size_t i = 0; i < curve.size(); ++i)
      CHECK((reduced.fine(i, flow.frame(i)) - curve.frames[i]).norm() < 1e-8);
  }
}

TEST_CASE("the reduced flow lowers the path energy in every step and comes near the full one") {
  const auto curve = tremblingCurve();
  const auto structure = std::make_shared<const ShellStructure>(pipe().topology);
  constexpr int kSteps = 12;
  SmoothingFlow full(structure, {bending(), EnergySymmetry::kDirected}, curve, {});
  for (int k = 0; k < kSteps; ++k) REQUIRE(full.step().converged());
  for (const int ghost : {302, 120}) {
    const ReducedCurve reduced(pipe().topology, bending(), curve, {.dimension = 8, .ghost_vertices = ghost});
    auto flow = reduced.flow({});
    double last = flow.pathEnergy();
    for (int k = 0; k < kSteps; ++k) {
      const auto step = flow.step();
      REQUIRE(step.converged());
      CHECK(step.solution.path_energy < last);
      last = step.solution.path_energy;
    }
    double gap = 0, moved = 0;
    for (std::size_t i = 0; i < curve.size(); ++i) {
      const Vertices fine = reduced.fine(i, flow.frame(i));
      gap = std::max(gap, rigidGap(fine, full.curve().frames[i]));
      moved = std::max(moved, rigidGap(curve.frames[i], full.curve().frames[i]));
      CHECK(smallestAreaRatio(pipe().topology->faces(), curve.frames[i], fine) > 0.9);
    }
    INFO("ghost of " << ghost << " vertices: " << gap << " of " << moved);
    CHECK(gap < 0.1 * moved);
  }
}

TEST_CASE("a reduced flow pulled by distances comes near the full one") {
  const auto curve = tremblingCurve();
  const auto structure = std::make_shared<const ShellStructure>(pipe().topology);
  for (const auto symmetry : {EnergySymmetry::kDirected, EnergySymmetry::kSymmetric}) {
    const SmoothingFlowOptions options{.restore = std::vector<double>(curve.size(), 0.3), .restore_scale = 2};
    SmoothingFlow full(structure, {bending(), EnergySymmetry::kSymmetric}, curve, options);
    const ReducedCurve reduced(pipe().topology, bending(), curve,
                               {.dimension = 8, .ghost_vertices = 302, .symmetry = symmetry});
    auto flow = reduced.flow(options);
    double before = 0, after = 0;
    for (int k = 0; k < 12; ++k) {
      REQUIRE(full.step().converged());
      const auto step = flow.step();
      REQUIRE(step.converged());
      CHECK(step.solution.after < step.solution.before);
      if (k == 0) before = step.solution.before;
      after = step.solution.after;
    }
    CHECK(after < 0.9 * before);
    double gap = 0, moved = 0;
    for (std::size_t i = 0; i < curve.size(); ++i) {
      gap = std::max(gap, rigidGap(reduced.fine(i, flow.frame(i)), full.curve().frames[i]));
      moved = std::max(moved, rigidGap(curve.frames[i], full.curve().frames[i]));
    }
    INFO(gap << " of " << moved);
    CHECK(gap < 0.1 * moved);
  }
}

TEST_CASE("averages by Newton's method and by the BFGS method make the same flow") {
  const auto curve = tremblingCurve();
  const auto run = [&](AverageMethod method) {
    const ReducedCurve reduced(pipe().topology, bending(), curve,
                               {.dimension = 8, .ghost_vertices = 120, .method = method, .tolerance = 1e-7});
    auto flow = reduced.flow({});
    int iterations = 0;
    for (int k = 0; k < 5; ++k) iterations += flow.step().iterations;
    std::vector<Vertices> frames;
    for (std::size_t i = 0; i < curve.size(); ++i) frames.push_back(reduced.fine(i, flow.frame(i)));
    return std::pair(frames, iterations);
  };
  const auto [bfgs, many] = run(AverageMethod::kBfgs);
  const auto [newton, few] = run(AverageMethod::kNewton);
  for (std::size_t i = 0; i < curve.size(); ++i) CHECK((bfgs[i] - newton[i]).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(few < many);
}

TEST_CASE("a reduced flow that is stopped leaves its curve as it was") {
  std::stop_source stop;
  const auto curve = wavingCurve(6);
  const ReducedCurve reduced(pipe().topology, bending(), curve, {.dimension = 4, .stop = stop.get_token()});
  auto flow = reduced.flow({.stop = stop.get_token()});
  stop.request_stop();
  CHECK(flow.step().termination == Termination::kCancelled);
  for (std::size_t i = 0; i < curve.size(); ++i)
    CHECK((reduced.fine(i, flow.frame(i)) - curve.frames[i]).norm() < 1e-8);
}

TEST_CASE("a reduced curve refuses what is no curve and no dimension") {
  auto curve = wavingCurve(4);
  CHECK_THROWS_WITH(ReducedCurve(pipe().topology, bending(), curve, {.dimension = 0}),
                    Catch::Contains("dimension = 0"));
  CHECK_THROWS_WITH(ReducedCurve(pipe().topology, bending(), curve, {.ghost_vertices = 3}),
                    Catch::Contains("vertex_count"));
  curve.frames[2](5, 0) = std::nan("");
  CHECK_THROWS_WITH(ReducedCurve(pipe().topology, bending(), curve, {}), Catch::Contains("frames[2]: vertex 5"));
}
