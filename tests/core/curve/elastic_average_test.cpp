#include "core/curve/elastic_average.h"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/support/calculus.h"
#include "tests/support/finite_differences.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const Mesh& sheet() {
  static const Mesh mesh = grid(6);
  return mesh;
}

struct Fixture {
  ShellStructurePtr structure = std::make_shared<const ShellStructure>(sheet().topology);
  double bending = defaultBending(sheet().vertices);
  std::vector<Vertices> shapes{curl(sheet().vertices, 0.3), curl(sheet().vertices, 1.4),
                               jitter(curl(sheet().vertices, 0.8), 0.01, 3)};
  std::vector<ShellMeasures> measures;

  Fixture() {
    for (const auto& shape : shapes) measures.push_back(measure(*sheet().topology, shape));
  }
  Solved<Vertices> average(const std::vector<double>& weights, EnergySymmetry symmetry) const {
    std::vector<AverageTerm> terms;
    for (std::size_t i = 0; i < weights.size(); ++i) terms.push_back({&measures[i], weights[i]});
    return elasticAverage(structure, {bending, symmetry}, terms, shapes.front(), {60, 1e-10, {}});
  }
};

}  // namespace

TEST_CASE("no small change of an elastic average lowers the sum that it minimises") {
  const Fixture f;
  const std::vector<double> weights{0.5, 1.5, 0.7};
  for (const auto symmetry : {EnergySymmetry::kSymmetric, EnergySymmetry::kDirected}) {
    const auto solved = f.average(weights, symmetry);
    REQUIRE(solved.converged());
    const auto sum = [&](const Vertices& y) {
      double total = 0;
      for (std::size_t i = 0; i < weights.size(); ++i) {
        total += weights[i] * shellEnergy(*sheet().topology, f.shapes[i], y, f.bending);
        if (symmetry == EnergySymmetry::kSymmetric)
          total += weights[i] * shellEnergy(*sheet().topology, y, f.shapes[i], f.bending);
      }
      return total;
    };
    const double at_start = differenceGradient(sum, f.shapes.front(), 1e-4).norm();
    CHECK(differenceGradient(sum, solved.solution, 1e-4).norm() < 1e-6 * at_start);
  }
}

TEST_CASE("an elastic average knows neither where its shapes are nor the scale of its weights") {
  Fixture f;
  const auto before = f.average({1, 2, 0.5}, EnergySymmetry::kSymmetric).solution;
  CHECK(rigidGap(f.average({10, 20, 5}, EnergySymmetry::kSymmetric).solution, before) < 1e-8);
  for (std::size_t i = 1; i < f.shapes.size(); ++i)
    f.measures[i] = measure(*sheet().topology, moveRigidly(f.shapes[i], static_cast<unsigned>(i)));
  CHECK(rigidGap(f.average({1, 2, 0.5}, EnergySymmetry::kSymmetric).solution, before) < 1e-8);
}

TEST_CASE("with all weight on one shape the average is that shape, and of two it is the point between them") {
  const Fixture f;
  CHECK(rigidGap(f.average({0, 1, 0}, EnergySymmetry::kSymmetric).solution, f.shapes[1]) < 1e-8);
  const GeodesicCalculus calculus(f.structure, {f.bending, EnergySymmetry::kSymmetric});
  const auto between = calculus.between(f.shapes[0], f.shapes[1], 0.3, {100, 1e-10, {}});
  REQUIRE(between.converged());
  CHECK(rigidGap(f.average({0.7, 0.3, 0}, EnergySymmetry::kSymmetric).solution, between.solution) < 1e-8);
}

TEST_CASE("an elastic average wants weights of which one is positive") {
  const Fixture f;
  CHECK_THROWS_WITH(f.average({0, 0, 0}, EnergySymmetry::kSymmetric), Catch::Contains("weights: are all zero"));
  for (const double bad : {-0.1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_WITH(f.average({1, bad, 1}, EnergySymmetry::kSymmetric), Catch::Contains("weights[1]"));
}
