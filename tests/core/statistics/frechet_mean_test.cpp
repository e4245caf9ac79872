#include "core/statistics/frechet_mean.h"

#include <tbb/global_control.h>

#include <Eigen/SVD>
#include <algorithm>
#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "core/numerics/threads.h"
#include "tests/support/literal_forces.h"
#include "tests/support/training_set.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// How thick a shape is where it is thinnest: 0 for a flat one.
double thickness(const Vertices& shape) {
  const Vertices centred = shape.rowwise() - shape.colwise().mean();
  return Eigen::JacobiSVD<Eigen::MatrixXd>(centred).singularValues()[2] / std::sqrt(static_cast<double>(shape.rows()));
}

Solved<Spider> meanOf(const GeodesicCalculus& calculus, const std::vector<Vertices>& shapes, int steps) {
  FrechetMeanOptions options;
  options.path_steps = steps;
  return frechetMean(calculus, shapes, options);
}

double spiderEnergy(const GeodesicCalculus& calculus, const Spider& spider) {
  double sum = 0;
  for (auto arm : spider.arms) {
    std::reverse(arm.begin(), arm.end());
    sum += calculus.pathEnergy(arm);
  }
  return sum / static_cast<double>(spider.arms.size());
}

}  // namespace

TEST_CASE("the mean balances its arms (25) and every arm is a geodesic (23), by literal forces") {
  const auto set = variedTubes();
  for (const int steps : {1, 3}) {
    const auto solved = meanOf(*set.calculus, set.shapes, steps);
    REQUIRE(solved.converged());
    CHECK(solved.residual <= 1e-8);
    const auto& spider = solved.solution;
    REQUIRE(spider.arms.size() == set.shapes.size());
    std::vector<Vertices> forces;
    for (std::size_t i = 0; i < spider.arms.size(); ++i) {
      const auto& arm = spider.arms[i];
      REQUIRE(arm.size() == static_cast<std::size_t>(steps) + 1);
      CHECK(arm.front() == spider.mean);
      CHECK(rigidGap(arm.back(), set.shapes[i]) < 1e-12);
      forces.push_back(literalSecondForce(*set.mesh.topology, arm[1], spider.mean, set.calculus->bending()));
      const Path inwards(arm.rbegin(), arm.rend());
      if (i % 2 == 0) CHECK(literalPathImbalance(*set.mesh.topology, inwards, set.calculus->bending()) < 2e-8);
    }
    CHECK(relativeImbalance(forces) < 2e-8);
    CHECK(relativeImbalance({forces[0], forces[1]}) > 0.1);  // the control
  }
}

TEST_CASE("the mean of copies of one shape, rigidly moved, is that shape") {
  const auto set = variedTubes();
  for (const int steps : {1, 4})
    for (const int copies : {1, 3}) {
      std::vector<Vertices> shapes;
      for (int i = 0; i < copies; ++i) shapes.push_back(moveRigidly(set.shapes[1], 5 + static_cast<unsigned>(i)));
      const auto solved = meanOf(*set.calculus, shapes, steps);
      INFO("K = " << steps << ", " << copies << " copies");
      REQUIRE(solved.converged());
      CHECK(rigidGap(solved.solution.mean, set.shapes[1]) < 1e-8);
      for (const auto& arm : solved.solution.arms)
        for (const auto& shape : arm) CHECK(rigidGap(shape, set.shapes[1]) < 1e-8);
    }
}

TEST_CASE("the mean of a shape and its mirror image is its own mirror image: two curls make a flat sheet") {
  const auto sheet = grid(6);
  const auto calculus = calculusOn(sheet);
  const Vertices left = curl(sheet.vertices, 1.5);
  Vertices right = left;
  right.col(2) *= -1;
  for (const int steps : {1, 2, 4}) {
    const auto solved = meanOf(calculus, {left, moveRigidly(right, 3)}, steps);
    REQUIRE(solved.converged());
    CHECK(thickness(left) > 0.05);
    CHECK(thickness(solved.solution.mean) < 1e-6);
    // mirrored, the two arms are one
    for (std::size_t k = 0; k < solved.solution.arms[0].size(); ++k) {
      Vertices mirrored = solved.solution.arms[0][k];
      mirrored.col(2) *= -1;
      CHECK(rigidGap(mirrored, solved.solution.arms[1][k]) < 1e-5);
    }
  }
}

TEST_CASE("the mean of a pair tends to the middle of their geodesic, and its energy to a quarter of the geodesic's") {
  // The arms run from both ends to the mean, the geodesic through it: with W[s, s~] and W[s~, s] differing in third
  // order the two agree up to a term in 1/K.
  const auto set = variedTubes();
  const Vertices &a = set.shapes[0], &b = set.shapes[3];
  std::vector<double> gaps, excess;
  for (const int steps : {1, 2, 4, 8}) {
    const auto spider = meanOf(*set.calculus, {a, b}, steps).solution;
    const auto path = set.calculus->interpolate(a, b, 2 * steps, {}).solution;
    gaps.push_back(rigidGap(spider.mean, path[static_cast<std::size_t>(steps)]) / rigidGap(a, b));
    excess.push_back(std::abs(4 * spiderEnergy(*set.calculus, spider) / set.calculus->pathEnergy(path) - 1));
  }
  CHECK(gaps[0] < 0.05);
  CHECK(excess[0] < 0.05);
  for (std::size_t k = 1; k < gaps.size(); ++k) {
    CHECK(order(gaps[k - 1], gaps[k]) > 0.8);
    CHECK(order(excess[k - 1], excess[k]) > 0.8);
  }
}

TEST_CASE("the mean is a minimum: moving it costs energy") {
  const auto set = variedTubes();
  const auto spider = set.spider(2);
  const double least = spiderEnergy(*set.calculus, spider);
  for (unsigned seed = 0; seed < 5; ++seed)
    for (const double size : {1e-3, 1e-2}) {
      auto moved = spider;
      moved.mean = jitter(spider.mean, size, seed);
      for (auto& arm : moved.arms) arm.front() = moved.mean;
      CHECK(spiderEnergy(*set.calculus, moved) > least);
    }
}

TEST_CASE("neither rigid motions nor the order of the shapes change the mean") {
  const auto set = variedTubes();
  const auto spider = set.spider(3);
  auto moved = set.shapes;
  for (unsigned i = 0; i < moved.size(); ++i) moved[i] = moveRigidly(moved[i], 80 + i);
  const auto other = meanOf(*set.calculus, moved, 3);
  REQUIRE(other.converged());
  CHECK(rigidGap(other.solution.mean, spider.mean) < 1e-6);

  const std::vector<std::size_t> order{3, 0, 4, 2, 1};
  std::vector<Vertices> shuffled;
  for (const auto i : order) shuffled.push_back(set.shapes[i]);
  const auto again = meanOf(*set.calculus, shuffled, 3);
  REQUIRE(again.converged());
  CHECK(rigidGap(again.solution.mean, spider.mean) < 1e-6);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = 0; k <= 3; ++k) CHECK(rigidGap(again.solution.arms[i][k], spider.arms[order[i]][k]) < 1e-6);
}

TEST_CASE("scaling every shape by s and eta by s^2 scales the mean by s") {
  const auto set = variedTubes();
  const auto spider = set.spider(2);
  for (const double s : {1e-3, 1e3}) {
    const GeodesicCalculus scaled(set.calculus->structure(), s * s * set.calculus->bending());
    auto shapes = set.shapes;
    for (auto& shape : shapes) shape *= s;
    const auto solved = meanOf(scaled, shapes, 2);
    REQUIRE(solved.converged());
    CHECK(rigidGap(solved.solution.mean / s, spider.mean) < 1e-6);
  }
}

TEST_CASE("the mean is the same to the last bit whatever the number of threads") {
  limitLibraryThreads();
  const auto set = variedTubes();
  std::vector<Spider> spiders;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    spiders.push_back(set.spider(3));
  }
  for (std::size_t other : {1, 2}) {
    CHECK(spiders[0].mean == spiders[other].mean);
    for (std::size_t i = 0; i < set.shapes.size(); ++i)
      for (std::size_t k = 0; k <= 3; ++k) CHECK(spiders[0].arms[i][k] == spiders[other].arms[i][k]);
  }
}

TEST_CASE("a mean starts from another one of similar shapes and ends in the same place") {
  const auto set = variedTubes();
  const auto spider = set.spider(3);
  auto shapes = set.shapes;
  for (unsigned i = 0; i < shapes.size(); ++i) shapes[i] = jitter(shapes[i], 0.01, 20 + i);
  const auto cold = meanOf(*set.calculus, shapes, 3);
  FrechetMeanOptions options;
  options.path_steps = 3;
  options.start = &spider;
  const auto warm = frechetMean(*set.calculus, shapes, options);
  REQUIRE(warm.converged());
  CHECK(rigidGap(warm.solution.mean, cold.solution.mean) < 1e-6);
  CHECK(frechetMean(*set.calculus, set.shapes, options).iterations == 0);

  options.path_steps = 2;
  CHECK_THROWS_WITH(frechetMean(*set.calculus, shapes, options), Catch::Contains("start.arms[0]"));
  options.path_steps = 3;
  shapes.pop_back();
  CHECK_THROWS_WITH(frechetMean(*set.calculus, shapes, options), Catch::Contains("start"));
}

TEST_CASE("the mean reports progress that never falls, and stops soon after it is told to") {
  const auto set = variedTubes();
  std::vector<Progress> reports;
  FrechetMeanOptions options;
  options.progress = [&](const Progress& progress) { reports.push_back(progress); };
  REQUIRE(frechetMean(*set.calculus, set.shapes, options).converged());
  REQUIRE(reports.size() > set.shapes.size());
  for (std::size_t k = 1; k < reports.size(); ++k) CHECK(reports[k].fraction >= reports[k - 1].fraction);
  CHECK(reports.back().fraction <= 1);
  CHECK(reports.back().residual <= 1e-8);

  for (const std::size_t after : {std::size_t{1}, set.shapes.size(), set.shapes.size() + 2}) {
    std::stop_source source;
    std::size_t count = 0, later = 0;
    options.stop = source.get_token();
    options.progress = [&](const Progress& progress) {
      if (++count == after) source.request_stop();
      later += count > after && progress.residual > 0;
    };
    const auto solved = frechetMean(*set.calculus, set.shapes, options);
    INFO("told after report " << after);
    CHECK(solved.termination == Termination::kCancelled);
    CHECK(later <= 1);  // no Newton step begins any more
    CHECK(solved.solution.mean.allFinite());
    CHECK(solved.solution.arms.size() == set.shapes.size());
  }
}

TEST_CASE("the mean refuses what it cannot work on, naming it") {
  const auto set = variedTubes();
  CHECK_THROWS_WITH(meanOf(*set.calculus, {}, 2), Catch::Contains("shapes"));
  CHECK_THROWS_WITH(meanOf(*set.calculus, set.shapes, 0), Catch::Contains("path_steps"));
  auto shapes = set.shapes;
  shapes[3](2, 1) = std::nan("");
  CHECK_THROWS_WITH(meanOf(*set.calculus, shapes, 2), Catch::Contains("shapes[3]"));
}
