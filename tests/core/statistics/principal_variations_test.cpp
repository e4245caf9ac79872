#include "core/statistics/principal_variations.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "tests/support/literal_forces.h"
#include "tests/support/training_set.h"

using namespace shaped;
using namespace shaped::test;

namespace {

ShellPga modelOf(const TrainingSet& set, const Spider& spider, int modes) {
  const auto solved = principalVariations(*set.calculus, spider, modes, {});
  INFO(name(solved.termination) << ", residual " << solved.residual);
  REQUIRE(solved.converged());
  CHECK(solved.residual <= 1e-8);
  return solved.solution;
}

}  // namespace

TEST_CASE("principal variations balance (14) by literal forces, with reflected shapes where weights are negative") {
  const auto set = variedTubes();
  const auto& topology = *set.mesh.topology;
  const double eta = set.calculus->bending();
  const auto spider = set.spider(2);
  const auto pga = modelOf(set, spider, 2);
  bool reflected_one = false;
  for (std::size_t j = 0; j < 2; ++j) {
    std::vector<Vertices> forces;
    for (std::size_t i = 0; i < set.shapes.size(); ++i) {
      const double weight = pga.eigenvectors(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      Vertices node = spider.arms[i][1];
      if (weight < 0) {
        node = set.calculus->extrapolateBackwards(spider.mean, node, {}).solution;
        if (!reflected_one) CHECK(literalPathImbalance(topology, {node, spider.mean, spider.arms[i][1]}, eta) < 2e-8);
        reflected_one = true;
      }
      forces.push_back(std::abs(weight) * literalSecondForce(topology, node, pga.variations[j], eta));
    }
    CHECK(relativeImbalance(forces) < 2e-8);
  }
  CHECK(reflected_one);
}

TEST_CASE("the model records the mean, all eigenvalues, J orthonormal eigenvectors and the path steps") {
  const auto set = variedTubes();
  const auto spider = set.spider(3);
  const auto decomposition = spectrum(gramMatrix(*set.calculus, spider));
  for (const int modes : {1, 3, 4}) {
    const auto pga = modelOf(set, spider, modes);
    CHECK(pga.modes() == modes);
    CHECK(pga.variations.size() == 2 * static_cast<std::size_t>(modes));
    CHECK(pga.mean == spider.mean);
    CHECK(pga.eigenvalues == decomposition.values);
    CHECK(pga.eigenvectors == decomposition.vectors.leftCols(modes));
    CHECK(pga.path_steps == 3);
  }
}

TEST_CASE("reflections: p_-j, the mean and p_j lie on one discrete geodesic, and reflecting p_-j returns p_j") {
  const auto set = variedTubes();
  std::vector<double> errors;
  for (const int steps : {2, 4, 8}) {
    const auto pga = modelOf(set, set.spider(steps), 3);
    double worst = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto &forward = pga.variations[j], &backward = pga.variations[3 + j];
      const double size = rigidGap(pga.mean, forward);
      const auto exact = set.calculus->extrapolate(backward, pga.mean, {});
      REQUIRE(exact.converged());
      CHECK(rigidGap(exact.solution, forward) < 1e-7 * size);
      const auto twice = set.calculus->at({pga.mean, backward}, -1, {});
      REQUIRE(twice.converged());
      worst = std::max(worst, rigidGap(twice.solution, forward) / size);
    }
    errors.push_back(worst);
  }
  CHECK(errors[0] < 0.02);
  for (std::size_t k = 1; k < errors.size(); ++k) CHECK(order(errors[k - 1], errors[k]) > 1.5);
}

TEST_CASE("a variation lies at the distance that its eigenvalue says: sqrt(n lambda) / (K sum |w|)") {
  const auto set = variedTubes();
  std::vector<double> errors;
  for (const int steps : {2, 4, 8}) {
    const auto pga = modelOf(set, set.spider(steps), 4);
    double worst = 0;
    for (Eigen::Index j = 0; j < 4; ++j) {
      const double weights = pga.eigenvectors.col(j).cwiseAbs().sum();
      const double expected = std::sqrt(5 * pga.eigenvalues[j]) / (steps * weights);
      const auto& shape = pga.variations[static_cast<std::size_t>(j)];
      const double found = std::sqrt(shellEnergy(*set.mesh.topology, pga.mean, shape, set.calculus->bending()));
      worst = std::max(worst, std::abs(found / expected - 1));
    }
    errors.push_back(worst);
  }
  CHECK(errors[0] < 0.1);
  for (std::size_t k = 1; k < errors.size(); ++k) CHECK(order(errors[k - 1], errors[k]) > 0.6);
}

TEST_CASE("rigid motions of the training shapes change no variation") {
  const auto set = variedTubes();
  const auto still = modelOf(set, set.spider(2), 3);
  auto moved = set;
  for (unsigned i = 0; i < moved.shapes.size(); ++i) moved.shapes[i] = moveRigidly(moved.shapes[i], 90 + i);
  const auto other = modelOf(moved, moved.spider(2), 3);
  for (std::size_t j = 0; j < still.variations.size(); ++j)
    CHECK(rigidGap(other.variations[j], still.variations[j]) < 1e-6);
}

TEST_CASE("identical training shapes still give a model of the directions that exist") {
  auto set = variedTubes();
  set.shapes = {set.shapes[0], moveRigidly(set.shapes[0], 1), set.shapes[3]};
  const auto pga = modelOf(set, set.spider(2), 1);
  CHECK(pga.eigenvalues[0] > 0.01);
  CHECK(std::abs(pga.eigenvalues[1]) < 0.02 * pga.eigenvalues[0]);
}

TEST_CASE("the number of modes is checked, and cancellation reported") {
  const auto set = variedTubes();
  const auto spider = set.spider(1);
  for (const int modes : {0, 5, -1})
    CHECK_THROWS_WITH(principalVariations(*set.calculus, spider, modes, {}), Catch::Contains("modes"));
  std::stop_source source;
  source.request_stop();
  CHECK(principalVariations(*set.calculus, spider, 2, {100, 1e-8, source.get_token()}).termination ==
        Termination::kCancelled);
}
