#include "tests/support/training_set.h"

#include <catch2/catch.hpp>

namespace shaped::test {
namespace {

constexpr std::array<double, 5> kBends{-1.0, -0.3, 0.4, 1.6, 2.4};

TrainingSet onTube(Mesh mesh) {
  auto calculus = std::make_shared<const GeodesicCalculus>(calculusOn(mesh));
  return {std::move(mesh), std::move(calculus), {}};
}

}  // namespace

Spider TrainingSet::spider(int steps) const {
  FrechetMeanOptions options;
  options.path_steps = steps;
  const auto solved = frechetMean(*calculus, shapes, options);
  INFO("mean of " << shapes.size() << " shapes, K = " << steps << ": " << name(solved.termination));
  REQUIRE(solved.converged());
  return solved.solution;
}

TrainingSet variedTubes() {
  auto set = onTube(tube(7, 6));
  constexpr std::array<double, 5> thickness{0.8, 1.0, 1.2, 0.9, 1.1}, length{0.84, 1.08, 0.92, 1.16, 1.0};
  for (unsigned i = 0; i < kBends.size(); ++i) {
    Vertices shape = set.mesh.vertices;
    shape.col(0) *= length[i];
    shape.col(1) *= thickness[i];
    set.shapes.push_back(moveRigidly(jitter(bend(shape, kBends[i]), 0.02, i), 50 + i));
  }
  return set;
}

TrainingSet bentTubes() {
  auto set = onTube(tube(9, 6));
  for (const double angle : kBends) set.shapes.push_back(bend(set.mesh.vertices, angle));
  return set;
}

}  // namespace shaped::test
