#include "core/curve/reduced_path.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "core/curve/block_tridiagonal.h"
#include "core/curve/path_enrichment.h"
#include "core/curve/reduced_path_newton.h"
#include "core/numerics/error.h"
#include "core/reduction/krylov.h"
#include "core/shell/shell_objective.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(16, 8);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);
  Vertices a = mesh.vertices, b = bend(mesh.vertices, 0.8);

  GhostSpace space(int dimension) const {
    return GhostSpace(mesh.topology, krylovSubspace(structure, bending, a, b, dimension).solution, {a, b}, 1000);
  }
  /// The straight line in coordinates.
  PathCoordinates line(const GhostSpace& space, std::size_t frames) const {
    PathCoordinates path;
    for (std::size_t i = 0; i < frames; ++i)
      path.push_back(space.fine().coordinates(a + double(i) / double(frames - 1) * (b - a)));
    return path;
  }
};

}  // namespace

TEST_CASE("the block tridiagonal factor solves as the dense matrix does") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto fill = [&](Eigen::Index n) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(n, n, [&] { return normal(random); }));
  };
  constexpr Eigen::Index d = 3, n = 5;
  std::vector<Eigen::MatrixXd> diagonal, above;
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(d * n, d * n);
  Eigen::VectorXd right(d * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::MatrixXd root = fill(d);
    diagonal.emplace_back(root * root.transpose() + 8 * Eigen::MatrixXd::Identity(d, d));
    whole.block(d * i, d * i, d, d) = diagonal.back();
    if (i + 1 < n) {
      above.push_back(fill(d));
      whole.block(d * i, d * (i + 1), d, d) = above.back();
      whole.block(d * (i + 1), d * i, d, d) = above.back().transpose();
    }
    right.segment(d * i, d) = fill(d).col(0);
  }
  BlockTridiagonalCholesky factor;
  CHECK(factor.blocks() == 0);
  REQUIRE(factor.factorise(diagonal, above, 0.5));
  CHECK(factor.blocks() == 5);
  CHECK(factor.size() == 3);
  const Eigen::VectorXd expected = (whole + 0.5 * Eigen::MatrixXd::Identity(d * n, d * n)).ldlt().solve(right);
  CHECK((factor.solve(right) - expected).norm() < 1e-12 * expected.norm());
  CHECK_FALSE(factor.factorise(diagonal, above, -20));
  CHECK(factor.blocks() == 0);
}

TEST_CASE("Newton's method finds a path without forces in the subspace, below the flow's") {
  const Fixture f;
  const auto space = f.space(12);
  auto newton = f.line(space, 9), flow = newton;
  const auto start = pathEnergy(space, f.bending, newton);
  const ReducedPathOptions exact{PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-9, 60, {}};
  const auto outcome = settle(space, f.bending, newton, exact);
  REQUIRE(outcome.converged());
  CHECK(outcome.residual <= 1e-9);
  CHECK(outcome.iterations <= 12);
  const double least = pathEnergy(space, f.bending, newton);
  CHECK(least < start);
  // by differences: no coordinate of any inner frame lowers the energy
  for (std::size_t i = 1; i < 8; ++i)
    for (Eigen::Index j = 0; j < space.dimension(); ++j)
      for (const double step : {1e-3, -1e-3}) {
        auto moved = newton;
        moved[i][j] += step;
        CHECK(pathEnergy(space, f.bending, moved) > least);
      }
  const auto settled = settle(space, f.bending, flow, {PathSolver::kFlow, EnergySymmetry::kSymmetric, 1e-6, 2000, {}});
  REQUIRE(settled.converged());
  CHECK(pathEnergy(space, f.bending, flow) >= least * (1 - 1e-12));
  CHECK(pathEnergy(space, f.bending, flow) <= least * (1 + 1e-4));
}

TEST_CASE("a kept Hessian settles the neighbouring path, to the same end as a new one") {
  const Fixture f;
  const auto space = f.space(12);
  const ReducedPathOptions options{PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-8, 60, {}};
  ReducedPathNewton kept(space, f.bending, options);
  auto path = f.line(space, 7);
  REQUIRE(kept.settle(path).converged());
  auto neighbour = path;
  neighbour.back() = space.fine().coordinates(bend(f.a, 0.75));
  auto fresh = neighbour;
  const auto outcome = kept.settle(neighbour);
  REQUIRE(outcome.converged());
  REQUIRE(settle(space, f.bending, fresh, options).converged());
  for (std::size_t i = 0; i < path.size(); ++i) CHECK((neighbour[i] - fresh[i]).norm() < 1e-5);
  // another number of frames needs another one
  auto longer = f.line(space, 9);
  CHECK(kept.settle(longer).converged());
}

TEST_CASE("Newton's method comes home from a path that is far from any geodesic") {
  const Fixture f;
  const auto space = f.space(12);
  auto path = f.line(space, 7);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (std::size_t i = 1; i < 6; ++i)
    for (auto& coordinate : path[i]) coordinate += 0.25 * path.back().norm() * normal(random);
  const double start = pathEnergy(space, f.bending, path);
  const ReducedPathOptions options{PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-6, 200, {}};
  const auto outcome = settle(space, f.bending, path, options);
  CHECK(outcome.termination != Termination::kNumericalFailure);
  CHECK(pathEnergy(space, f.bending, path) < 0.05 * start);
}

TEST_CASE("Newton's method for a path says how it ended") {
  const Fixture f;
  const auto space = f.space(6);
  auto path = f.line(space, 9);
  CHECK(settle(space, f.bending, path, {PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-9, 1, {}}).termination ==
        Termination::kIterationLimit);
  std::stop_source stop;
  stop.request_stop();
  auto untouched = path;
  CHECK(
      settle(space, f.bending, untouched, {PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-9, 9, stop.get_token()})
          .termination == Termination::kCancelled);
  CHECK(untouched == path);
  path[4][0] = std::numeric_limits<double>::quiet_NaN();
  CHECK(settle(space, f.bending, path, {}).termination == Termination::kNumericalFailure);
  PathCoordinates two{path[0], path[8]};
  CHECK(settle(space, f.bending, two, {}).converged());
}

TEST_CASE("points of a path are its frames and averages between them") {
  const Fixture f;
  const auto space = f.space(12);
  auto path = f.line(space, 5);
  REQUIRE(settle(space, f.bending, path, {}).converged());
  CHECK(pointOf(space, f.bending, path, 0.25, {}).solution == path[1]);
  CHECK(pointOf(space, f.bending, path, 1, {}).solution == path[4]);
  const auto between = pointOf(space, f.bending, path, 0.375, {});
  REQUIRE(between.converged());
  CHECK((between.solution - 0.5 * (path[1] + path[2])).norm() < 0.1 * (path[1] - path[2]).norm());
  const auto finer = resampled(space, f.bending, path, 9, {});
  REQUIRE(finer.size() == 9);
  CHECK(finer[2] == path[1]);
  // found one after the other, from each other's Hessians: the same to the solver's tolerance
  CHECK((finer[3] - between.solution).norm() < 1e-3 * between.solution.norm());
  // half a step each: a quarter of the energy per segment, twice the segments
  CHECK(pathEnergy(space, f.bending, finer) == Approx(0.5 * pathEnergy(space, f.bending, path)).epsilon(0.01));
}

TEST_CASE("enrichment adds what the full problem's path needs") {
  const Fixture f;
  auto space = f.space(4);
  auto path = f.line(space, 5);
  const ReducedPathOptions options{PathSolver::kNewton, EnergySymmetry::kSymmetric, 1e-7, 60, {}};
  REQUIRE(settle(space, f.bending, path, options).converged());
  const GeodesicCalculus calculus(f.structure, {f.bending, EnergySymmetry::kSymmetric});
  const auto exact = calculus.interpolate(f.a, f.b, 4, {100, 1e-10, {}});
  REQUIRE(exact.converged());
  const auto gap = [&] {
    double squares = 0, size = 0;
    for (std::size_t i = 0; i < 5; ++i) {
      const auto shape = space.fine().shape(path[i]);
      squares += std::pow(rigidGap(shape, exact.solution[i]), 2);
      size += std::pow(rigidGap(exact.solution[i], Vertices::Zero(shape.rows(), 3)), 2);
    }
    return std::sqrt(squares / size);
  };
  double last = gap(), missing = std::numeric_limits<double>::infinity();
  CHECK(last > 1e-4);
  for (int round = 0; round < 4; ++round) {
    const auto grown = enrich(f.structure, f.bending, space, {path}, 1e-12);
    CHECK(grown.added >= 1);
    CHECK(grown.missing < missing);
    missing = grown.missing;
    path = extended(path, space);
    REQUIRE(settle(space, f.bending, path, options).converged());
    CHECK(gap() < last);
    last = gap();
  }
  CHECK(last < 1e-5);
  CHECK(missing < 1e-4);
  CHECK(enrich(f.structure, f.bending, space, {path}, 1).added == 0);
}
