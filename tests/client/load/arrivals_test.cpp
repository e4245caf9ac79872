#include "client/load/arrivals.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "core/numerics/error.h"

using namespace shaped::client;

namespace {

std::vector<double> gaps(Arrivals arrivals, int count) {
  std::vector<double> gaps;
  double before = 0;
  for (int i = 0; i < count; ++i) {
    const double time = std::chrono::duration<double>(arrivals.next()).count();
    gaps.push_back(time - before);
    before = time;
  }
  return gaps;
}

}  // namespace

TEST_CASE("fixed arrivals keep their times for hours") {
  Arrivals arrivals(Arrivals::Kind::kFixed, 3, 1);
  CHECK(arrivals.next().count() == 0);
  CHECK(arrivals.next().count() == 333'333'333);
  for (int i = 2; i < 30'000; ++i) arrivals.next();
  CHECK(arrivals.next() == std::chrono::seconds(10'000));
}

TEST_CASE("Poisson arrivals have exponential gaps of the wanted rate") {
  const int count = 200'000;
  const auto all = gaps({Arrivals::Kind::kPoisson, 500, 7}, count);
  double sum = 0, squares = 0, longer = 0;
  for (const double gap : all) {
    REQUIRE(gap >= 0);
    sum += gap;
    squares += gap * gap;
    if (gap > 1.0 / 500) ++longer;
  }
  const double mean = sum / count, deviation = std::sqrt(squares / count - mean * mean);
  CHECK(mean == Approx(1.0 / 500).epsilon(0.01));
  // What tells it from equal gaps: the deviation is the mean, and a share of 1/e is longer than it.
  CHECK(deviation == Approx(mean).epsilon(0.02));
  CHECK(longer / count == Approx(std::exp(-1)).epsilon(0.02));
}

TEST_CASE("arrivals depend on the seed and on nothing else") {
  const auto first = gaps({Arrivals::Kind::kPoisson, 10, 1}, 100);
  CHECK(first == gaps({Arrivals::Kind::kPoisson, 10, 1}, 100));
  CHECK(first != gaps({Arrivals::Kind::kPoisson, 10, 2}, 100));
}

TEST_CASE("rates that are none are refused") {
  for (const double rate : {0.0, -1.0, 2e6, std::nan(""), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(Arrivals(Arrivals::Kind::kFixed, rate, 1), shaped::InvalidInput);
}
