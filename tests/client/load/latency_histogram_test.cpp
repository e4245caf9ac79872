#include "client/load/latency_histogram.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

using namespace shaped::client;
using std::chrono::nanoseconds;

TEST_CASE("an empty histogram knows nothing") {
  const LatencyHistogram times;
  CHECK(times.count() == 0);
  CHECK(times.quantile(0.5).count() == 0);
  CHECK(times.max().count() == 0);
  CHECK(times.mean().count() == 0);
}

TEST_CASE("quantiles are those of the sorted values, to 0.4 percent") {
  std::mt19937 random(3);
  std::lognormal_distribution<double> draw(std::log(2e6), 2);  // 2 ms, and a long tail
  LatencyHistogram times;
  std::vector<double> values;
  for (int i = 0; i < 50'000; ++i) {
    values.push_back(std::round(draw(random)));
    times.record(nanoseconds(static_cast<std::int64_t>(values.back())));
  }
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.0, 0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(fraction * 50'000))) - 1;
    INFO(fraction);
    CHECK(static_cast<double>(times.quantile(fraction).count()) == Approx(values[rank]).epsilon(0.004));
  }
  CHECK(static_cast<double>(times.max().count()) == values.back());
  double sum = 0;
  for (const double value : values) sum += value;
  CHECK(static_cast<double>(times.mean().count()) == Approx(sum / 50'000).epsilon(1e-6));
}

TEST_CASE("small durations are kept exactly, and the range has no end") {
  for (const std::int64_t value : {0L, 1L, 127L, 128L, 255L, 256L, 257L, 1'000'003L, (1L << 40) + 1, INT64_MAX}) {
    LatencyHistogram times;
    times.record(nanoseconds(value));
    INFO(value);
    const auto seen = times.quantile(0.5).count();
    if (value < 257)
      CHECK(seen == value);
    else
      CHECK(std::abs(static_cast<double>(seen - value)) <= 0.004 * static_cast<double>(value));
    CHECK(times.max().count() == value);
  }
  LatencyHistogram times;
  times.record(nanoseconds(-5));
  CHECK(times.max().count() == 0);
}
