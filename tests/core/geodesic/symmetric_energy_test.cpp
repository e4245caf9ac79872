#include <catch2/catch.hpp>

#include "core/statistics/gram.h"
#include "tests/support/training_set.h"

using namespace shaped;
using namespace shaped::test;

namespace {

GeodesicCalculus with(const GeodesicCalculus& calculus, EnergySymmetry symmetry) {
  return {calculus.structure(), {calculus.bending(), symmetry}};
}

/// The largest gap between a path's nodes and those of the path from the other end.
double backwardsGap(const GeodesicCalculus& calculus, const Vertices& a, const Vertices& b, int steps) {
  const auto forth = calculus.interpolate(a, b, steps, {}), back = calculus.interpolate(b, a, steps, {});
  REQUIRE(forth.converged());
  REQUIRE(back.converged());
  double widest = 0;
  for (std::size_t k = 0; k < forth.solution.size(); ++k)
    widest = std::max(widest, rigidGap(forth.solution[k], back.solution[back.solution.size() - 1 - k]));
  return widest;
}

}  // namespace

TEST_CASE("geodesics of the symmetric energy are the same from either end, directed ones only nearly") {
  const auto set = variedTubes();
  const auto symmetric = with(*set.calculus, EnergySymmetry::kSymmetric);
  const auto directed = with(*set.calculus, EnergySymmetry::kDirected);
  CHECK(backwardsGap(symmetric, set.shapes[0], set.shapes[3], 4) < 1e-6);
  const double coarse = backwardsGap(directed, set.shapes[0], set.shapes[3], 4);
  const double fine = backwardsGap(directed, set.shapes[0], set.shapes[3], 8);
  CHECK(coarse > 1e-3);
  CHECK(order(coarse, fine) == Approx(1).margin(0.3));  // of first order in 1 / K
}

TEST_CASE("with the symmetric energy extrapolating backwards is extrapolating the path turned round") {
  const auto set = variedTubes();
  const auto calculus = with(*set.calculus, EnergySymmetry::kSymmetric);
  const auto path = calculus.interpolate(set.shapes[1], set.shapes[2], 4, {}).solution;
  const auto before = calculus.extrapolateBackwards(path[0], path[1], {}),
             after = calculus.extrapolate(path[1], path[0], {});
  REQUIRE(before.converged());
  REQUIRE(after.converged());
  CHECK(rigidGap(before.solution, after.solution) < 1e-6);
  CHECK(rigidGap(before.solution, path[0]) > 1e-2);
  // the balance (23) at path[0], where nodes are known: one more step forwards comes back to path[1]
  const auto next = calculus.extrapolate(before.solution, path[0], {});
  CHECK(rigidGap(next.solution, path[1]) < 1e-6);
  const auto inside = calculus.between(path[0], path[1], 0.3, {}),
             mirrored = calculus.between(path[1], path[0], 0.7, {});
  CHECK(rigidGap(inside.solution, mirrored.solution) < 1e-6);
  const auto end = calculus.through(path[0], inside.solution, 0.3, {});
  CHECK(rigidGap(end.solution, path[1]) < 1e-5);
}

TEST_CASE("the Gram matrix converges with second order in 1 / K for the symmetric energy and first for the directed") {
  auto set = variedTubes();
  const auto orderOf = [&](EnergySymmetry symmetry) {
    set.calculus = std::make_shared<const GeodesicCalculus>(with(*set.calculus, symmetry));
    std::vector<Eigen::MatrixXd> grams;
    for (const int steps : {4, 8, 16}) grams.push_back(gramMatrix(*set.calculus, set.spider(steps)));
    return order((grams[1] - grams[0]).norm(), (grams[2] - grams[1]).norm());
  };
  CHECK(orderOf(EnergySymmetry::kSymmetric) > 1.9);
  CHECK(orderOf(EnergySymmetry::kDirected) == Approx(1).margin(0.35));
}
