#include "core/numerics/vector_math.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace shaped;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Distance in units in the last place of the reference; 0 for equal values, infinities and NaN included.
double ulps(double value, double reference) {
  if (value == reference || (std::isnan(value) && std::isnan(reference))) return 0;
  return std::abs(value - reference) / (std::nextafter(std::abs(reference), kInfinity) - std::abs(reference));
}

/// Numbers over many orders of magnitude, of both signs.
std::vector<double> samples(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-30, 30), sign(-1, 1);
  std::vector<double> result(1003);  // no multiple of a vector's width
  for (auto& x : result) x = std::copysign(std::pow(10, exponent(random)), sign(random));
  return result;
}

}  // namespace

TEST_CASE("vector logarithms equal the scalar one to a few units in the last place, also at special values") {
  auto x = samples(1);
  for (auto& value : x) value = std::abs(value);
  for (int i = 0; i < 200; ++i) x[static_cast<std::size_t>(i)] = 1 + (i - 100) * 1e-6;
  x[300] = 0, x[301] = kInfinity, x[302] = std::nan(""), x[303] = -1, x[304] = 1;
  std::vector<double> result(x.size());
  logarithms(x, result);
  for (std::size_t i = 0; i < x.size(); ++i) {
    INFO("log " << x[i]);
    CHECK(ulps(result[i], std::log(x[i])) <= 4);
  }
  logarithms(x, x);
  CHECK(x[500] == result[500]);
}

TEST_CASE("vector arc tangents equal the scalar one in every quadrant, on the axes and at special values") {
  auto y = samples(2), x = samples(3);
  const std::vector<double> special{0, -0.0, 1, -1, 1e-300, -1e300, kInfinity, -kInfinity, std::nan("")};
  std::size_t at = 0;
  for (const double a : special)
    for (const double b : special) y[at] = a, x[at] = b, ++at;
  std::vector<double> result(x.size());
  arcTangents(y, x, result);
  for (std::size_t i = 0; i < x.size(); ++i) {
    INFO("atan2(" << y[i] << ", " << x[i] << ")");
    CHECK(ulps(result[i], std::atan2(y[i], x[i])) <= 4);
  }
}
