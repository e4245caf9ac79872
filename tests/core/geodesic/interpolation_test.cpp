#include <catch2/catch.hpp>
#include <chrono>
#include <numeric>
#include <thread>

#include "core/geodesic/geodesic.h"
#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "tests/support/calculus.h"
#include "tests/support/literal_forces.h"

using namespace shaped;
using namespace shaped::test;

namespace {

double energySum(const GeodesicCalculus& calculus, const Path& path) {
  const auto energies = calculus.segmentEnergies(path);
  return std::accumulate(energies.begin(), energies.end(), 0.0);
}

/// Bent, stretched and made irregular: nothing about the pair is symmetric.
Vertices uneven(const Mesh& pipe, double angle) {
  Vertices shape = pipe.vertices;
  shape.col(0) *= 1.15;
  shape.col(2) *= 0.9;
  return jitter(bend(shape, angle), 0.02, 5);
}

}  // namespace

TEST_CASE("geodesics keep their ends and balance the literal forces (23) at every inner shape") {
  const auto pipe = tube(7, 6);
  const auto calculus = calculusOn(pipe);
  const Vertices a = uneven(pipe, -0.6), b = moveRigidly(bend(pipe.vertices, 1.2), 1);
  for (const int steps : {1, 2, 3, 5, 8}) {
    INFO("K = " << steps);
    const auto solved = calculus.interpolate(a, b, steps, {});
    REQUIRE(solved.converged());
    const auto& path = solved.solution;
    REQUIRE(path.size() == static_cast<std::size_t>(steps) + 1);
    CHECK(path.front() == a);
    CHECK(path.back() == b);
    CHECK(solved.residual <= 1e-8);
    CHECK(literalPathImbalance(*pipe.topology, path, calculus.bending()) < 2e-8);
    CHECK(calculus.pathEnergy(path) ==
          Approx(literalPathEnergy(*pipe.topology, path, calculus.bending())).epsilon(1e-9));
    CHECK(calculus.pathEnergy(path) == Approx(steps * energySum(calculus, path)).epsilon(1e-14));
    CHECK(calculus.distance(path) == Approx(std::sqrt(calculus.pathEnergy(path))).epsilon(1e-14));
  }
}

TEST_CASE("large bends, 2.5 radians each way, converge at every K, and the middle is the straight tube") {
  const auto pipe = tube(13, 8);
  const auto calculus = calculusOn(pipe);
  const Vertices a = bend(pipe.vertices, -2.5), b = moveRigidly(bend(pipe.vertices, 2.5), 3);
  for (const int steps : {2, 3, 5, 8}) {
    const auto solved = calculus.interpolate(a, b, steps, {});
    INFO("K = " << steps << ": " << name(solved.termination) << ", residual " << solved.residual);
    REQUIRE(solved.converged());
    CHECK(solved.residual <= 1e-8);
    CHECK(solved.iterations <= 20);
    if (steps % 2 == 0)
      CHECK(rigidGap(solved.solution[static_cast<std::size_t>(steps) / 2], pipe.vertices) <
            0.04 * rigidGap(a, pipe.vertices));
    for (const auto& shape : solved.solution)
      CHECK(measure(*pipe.topology, shape).area.minCoeff() > 0.5 * measure(*pipe.topology, a).area.minCoeff());
  }
}

TEST_CASE("the speed along a geodesic becomes constant as K grows") {
  const auto pipe = tube(9, 6);
  const auto calculus = calculusOn(pipe);
  const Vertices a = pipe.vertices, b = uneven(pipe, 1.8);
  std::vector<double> excess;
  for (const int steps : {2, 4, 8, 16})
    excess.push_back(speedRatio(calculus, calculus.interpolate(a, b, steps, {}).solution) - 1);
  CHECK(excess[0] < 0.2);
  for (std::size_t k = 1; k < excess.size(); ++k) CHECK(order(excess[k - 1], excess[k]) > 0.5);
  CHECK(excess.back() < 0.02);
}

TEST_CASE("the squared distance converges in K: to second order where the pair is symmetric, else at least to first") {
  const auto pipe = tube(9, 6);
  const auto calculus = calculusOn(pipe);
  const auto slopes = [&](const Vertices& a, const Vertices& b) {
    std::vector<double> energies;
    for (const int steps : {2, 4, 8, 16})
      energies.push_back(calculus.pathEnergy(calculus.interpolate(a, b, steps, {}).solution));
    // successive differences fall by 2^order
    return std::array{order(energies[1] - energies[0], energies[2] - energies[1]),
                      order(energies[2] - energies[1], energies[3] - energies[2])};
  };
  for (const double slope : slopes(bend(pipe.vertices, -1.5), bend(pipe.vertices, 1.5)))
    CHECK(slope == Approx(2).margin(0.15));
  // W[s, s~] and W[s~, s] differ in third order, which leaves a term in 1/K
  for (const double slope : slopes(pipe.vertices, uneven(pipe, 1.5))) CHECK(slope > 0.8);
}

TEST_CASE("rigid motions of either end change no energy and no shape") {
  const auto pipe = tube(9, 6);
  const auto calculus = calculusOn(pipe);
  const Vertices a = uneven(pipe, -0.7), b = bend(pipe.vertices, 1.4);
  const auto still = calculus.interpolate(a, b, 4, {}).solution;
  for (unsigned seed = 1; seed < 4; ++seed) {
    const auto moved = calculus.interpolate(seed == 2 ? a : moveRigidly(a, seed), moveRigidly(b, 10 + seed), 4, {});
    REQUIRE(moved.converged());
    CHECK(calculus.pathEnergy(moved.solution) == Approx(calculus.pathEnergy(still)).epsilon(1e-11));
    for (std::size_t k = 0; k < still.size(); ++k) CHECK(rigidGap(moved.solution[k], still[k]) < 1e-6);
  }
}

TEST_CASE("scaling every input by s and eta by s^2 scales the energies by s^2 and changes no shape") {
  const auto pipe = tube(9, 6);
  const auto calculus = calculusOn(pipe);
  const Vertices a = uneven(pipe, -0.7), b = bend(pipe.vertices, 1.4);
  const auto path = calculus.interpolate(a, b, 4, {}).solution;
  const auto beyond = calculus.at(path, 1.5, {}).solution;
  CHECK(defaultBending(moveRigidly(pipe.vertices, 5)) == Approx(calculus.bending()).epsilon(1e-12));
  for (const double s : {1e-3, 1e3}) {
    CHECK(defaultBending(s * pipe.vertices) == Approx(s * s * calculus.bending()).epsilon(1e-12));
    const GeodesicCalculus scaled(calculus.structure(), s * s * calculus.bending());
    const auto solved = scaled.interpolate(s * a, s * b, 4, {});
    REQUIRE(solved.converged());
    CHECK(scaled.pathEnergy(solved.solution) == Approx(s * s * calculus.pathEnergy(path)).epsilon(1e-10));
    for (std::size_t k = 0; k < path.size(); ++k) CHECK(rigidGap(solved.solution[k] / s, path[k]) < 1e-6);
    CHECK(rigidGap(scaled.at(solved.solution, 1.5, {}).solution / s, beyond) < 1e-5);
  }
  const GeodesicCalculus other(calculus.structure(), 4 * calculus.bending());  // the control: eta alone matters
  CHECK(other.pathEnergy(other.interpolate(a, b, 4, {}).solution) > 1.001 * calculus.pathEnergy(path));
}

TEST_CASE("a warm start reaches the same path in fewer steps, and a useless one does no harm") {
  const auto pipe = tube(9, 6);
  const auto calculus = calculusOn(pipe);
  const Vertices a = uneven(pipe, -0.7), b = bend(pipe.vertices, 1.4), nearby = jitter(b, 0.01, 3);
  const auto before = calculus.interpolate(a, b, 4, {});
  const auto cold = calculus.interpolate(a, nearby, 4, {});
  const auto warm = calculus.interpolate(a, nearby, 4, {}, before.solution);
  REQUIRE(warm.converged());
  CHECK(warm.solution.back() == nearby);
  CHECK(warm.iterations <= cold.iterations);
  CHECK(calculus.pathEnergy(warm.solution) == Approx(calculus.pathEnergy(cold.solution)).epsilon(1e-10));
  for (std::size_t k = 0; k <= 4; ++k) CHECK(rigidGap(warm.solution[k], cold.solution[k]) < 1e-6);
  const auto again = calculus.interpolate(a, b, 4, {}, before.solution);
  CHECK(again.iterations == 0);

  auto useless = before.solution;
  useless[2].setZero();  // infinite energy
  const Path wrong_length(3, a);
  for (const auto& start : {useless, wrong_length}) {
    const auto solved = calculus.interpolate(a, b, 4, {}, start);
    REQUIRE(solved.converged());
    CHECK(calculus.pathEnergy(solved.solution) == Approx(calculus.pathEnergy(before.solution)).epsilon(1e-10));
  }
}

TEST_CASE("equal and nearly equal ends converge to a path at rest, in place or moved") {
  for (const auto& mesh : {tube(9, 6), icosphere(2), grid(6)}) {
    const auto calculus = calculusOn(mesh);
    for (const double difference : {0.0, 1e-9, 1e-7, 1e-5})
      for (const unsigned motion : {0u, 4u}) {
        Vertices b = jitter(mesh.vertices, difference, 2);
        if (motion) b = moveRigidly(b, motion);
        INFO("difference " << difference << ", motion " << motion);
        const auto solved = calculus.interpolate(mesh.vertices, b, 4, {});
        CHECK(solved.converged());
        CHECK(solved.iterations <= 5);
        CHECK(calculus.distance(solved.solution) <= 100 * difference + 1e-6);
        for (const auto& shape : solved.solution) CHECK(rigidGap(shape, mesh.vertices) < 3 * difference + 1e-7);
      }
  }
}

TEST_CASE("slivers: thin triangles near collapse still converge and stay alive") {
  auto sheet = grid(7);
  const auto calculus = calculusOn(sheet);
  for (const double height : {1e-2, 1e-3, 1e-4}) {
    INFO("height over edge " << height);
    Vertices a = sheet.vertices, b = curl(sheet.vertices, 1.2);
    for (auto* shape : {&a, &b}) {  // vertex 24 nearly on the edge of its neighbours 16 and 17
      const Eigen::RowVector3d foot = 0.5 * (shape->row(16) + shape->row(17));
      shape->row(24) = foot + height * (shape->row(24) - foot);
    }
    const double thinnest = measure(*sheet.topology, a).area.minCoeff();
    const auto solved = calculus.interpolate(a, moveRigidly(b, 2), 4, {});
    INFO(name(solved.termination) << ", residual " << solved.residual << ", " << solved.iterations << " steps");
    CHECK(solved.converged());
    CHECK(speedRatio(calculus, solved.solution) < 1.2);
    for (const auto& shape : solved.solution) CHECK(measure(*sheet.topology, shape).area.minCoeff() > 0.2 * thinnest);
  }
}

TEST_CASE("an interpolation that is told to stop says so, quickly, at any moment") {
  const auto pipe = tube(40, 16);
  const auto calculus = calculusOn(pipe);
  const Vertices a = bend(pipe.vertices, -2.5), b = bend(pipe.vertices, 2.5);
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  SECTION("before it begins") {
    std::stop_source source;
    source.request_stop();
    const auto begin = Clock::now();
    const auto solved = calculus.interpolate(a, b, 8, {100, 1e-8, source.get_token()});
    CHECK(solved.termination == Termination::kCancelled);
    CHECK(seconds(Clock::now() - begin) < 0.1);
    REQUIRE(solved.solution.size() == 9);
    CHECK(solved.solution.front() == a);
    CHECK(solved.solution.back() == b);
    CHECK(std::isfinite(calculus.pathEnergy(solved.solution)));
  }
  SECTION("while it runs") {
    for (const int milliseconds : {1, 20, 60}) {
      std::stop_source source;
      Clock::time_point fired;
      const std::jthread watcher([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
        fired = Clock::now();
        source.request_stop();
      });
      const auto solved = calculus.interpolate(a, b, 16, {100, 1e-14, source.get_token()});  // never reached
      INFO("after " << milliseconds << " ms");
      CHECK(solved.termination == Termination::kCancelled);
      CHECK(seconds(Clock::now() - fired) < 0.5);  // room for a loaded machine
      CHECK(solved.solution.size() == 17);
    }
  }
}

TEST_CASE("interpolation refuses what it cannot work on, naming the field") {
  const auto pipe = tube(5, 5);
  const auto calculus = calculusOn(pipe);
  const Vertices good = pipe.vertices;
  CHECK_THROWS_WITH(calculus.interpolate(good, good, 0, {}), Catch::Contains("path_steps"));
  CHECK_THROWS_AS(calculus.interpolate(good.topRows(9), good, 2, {}), InvalidInput);
  Vertices broken = good;
  broken(3, 1) = std::nan("");
  CHECK_THROWS_AS(calculus.interpolate(good, broken, 2, {}), InvalidInput);
  Vertices collapsed = good;
  collapsed.row(1) = collapsed.row(0);
  CHECK_THROWS_AS(calculus.interpolate(collapsed, good, 2, {}), InvalidInput);
  CHECK_THROWS_WITH(calculus.at({good, good}, std::nan(""), {}), Catch::Contains("t:"));
}
