#include "server/telemetry/sketch.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

using namespace shaped::server;
using namespace std::chrono_literals;

TEST_CASE("a sketch's quantiles are those of the sorted values, to 2.5 %") {
  std::mt19937 random(3);
  std::lognormal_distribution<double> durations(-5, 2);
  std::vector<double> values;
  Sketch sketch;
  for (int i = 0; i < 5000; ++i) sketch.observe(values.emplace_back(durations(random)));
  std::sort(values.begin(), values.end());
  CHECK(sketch.count() == values.size());
  for (const double fraction : {0.0, 0.01, 0.5, 0.9, 0.99, 1.0}) {
    const auto rank = static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1));
    INFO(fraction);
    CHECK(sketch.quantile(fraction) == Approx(values[rank]).epsilon(0.0251));
  }
}

TEST_CASE("sketches of parts merge to the sketch of the whole") {
  Sketch whole, left, right;
  for (int i = 1; i <= 1000; ++i) {
    whole.observe(1e-4 * i);
    (i % 3 == 0 ? left : right).observe(1e-4 * i);
  }
  left.merge(right);
  CHECK(left.count() == 1000);
  for (const double fraction : {0.1, 0.5, 0.99}) CHECK(left.quantile(fraction) == whole.quantile(fraction));
}

TEST_CASE("a sketch takes any number") {
  Sketch sketch;
  CHECK(sketch.quantile(0.5) == 0);
  for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e-30}) sketch.observe(value);
  CHECK(sketch.quantile(1) < 1.1e-6);
  sketch.observe(std::numeric_limits<double>::infinity());
  sketch.observe(1e300);
  CHECK(sketch.quantile(1) > 9e4);
  CHECK(sketch.count() == 6);
}

TEST_CASE("a recent sketch forgets what is older than a minute") {
  RecentSketch recent;
  const auto start = RecentSketch::Clock::time_point(1000h);
  recent.observe(1, start);
  recent.observe(0.01, start + 30s);
  CHECK(recent.recent(start + 45s).count() == 2);
  CHECK(recent.recent(start + 70s).count() == 1);
  CHECK(recent.recent(start + 70s).quantile(1) == Approx(0.01).epsilon(0.03));
  CHECK(recent.recent(start + 120s).count() == 0);
  // The slices are used again.
  recent.observe(5, start + 60s);
  CHECK(recent.recent(start + 60s).count() == 2);
  CHECK(recent.recent(start + 60s).quantile(1) == Approx(5).epsilon(0.03));
}
