#include "core/reduction/krylov.h"

#include <catch2/catch.hpp>

#include "core/mesh/alignment.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

struct Fixture {
  Mesh mesh = tube(16, 8);
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(mesh.topology);
  double bending = defaultBending(mesh.vertices);
  Vertices a = mesh.vertices, b;

  Fixture() {
    const Vertices bent = bend(mesh.vertices, 0.8);
    b = apply(alignRigidly(bent, a), bent);
  }
};

double distanceTo(const ShapeSubspace& space, const Vertices& shape) {
  return (space.shape(space.coordinates(shape)) - shape).norm();
}

}  // namespace

TEST_CASE("a Krylov subspace contains both shapes and comes ever nearer to the geodesic between them") {
  const Fixture f;
  const GeodesicCalculus calculus(f.structure, {f.bending, EnergySymmetry::kSymmetric});
  const auto geodesic = calculus.interpolate(f.a, f.b, 4, {100, 1e-8, {}});
  REQUIRE(geodesic.converged());
  const auto middle = apply(alignRigidly(geodesic.solution[2], f.a), geodesic.solution[2]);
  const Vertices straight = 0.5 * (f.a + f.b);
  double last = (middle - straight).norm();
  for (const int dimension : {3, 7, 15}) {
    const auto space = krylovSubspace(f.structure, f.bending, f.a, f.b, dimension);
    REQUIRE(space.converged());
    const auto& basis = space.solution.basis;
    REQUIRE(basis.cols() == dimension);
    CHECK((basis.transpose() * basis - Eigen::MatrixXd::Identity(dimension, dimension)).norm() < 1e-12);
    CHECK(distanceTo(space.solution, f.a) < 1e-12);
    CHECK(distanceTo(space.solution, f.b) < 1e-12);
    const double distance = distanceTo(space.solution, middle);
    CHECK(distance < last);
    last = distance;
  }
  CHECK(last < 0.2 * (middle - straight).norm());
}

TEST_CASE("equal shapes span nothing, and a stop is told") {
  const Fixture f;
  CHECK(krylovSubspace(f.structure, f.bending, f.a, f.a, 9).solution.dimension() == 0);
  std::stop_source stop;
  stop.request_stop();
  CHECK(krylovSubspace(f.structure, f.bending, f.a, f.b, 9, stop.get_token()).termination == Termination::kCancelled);
}
