#include "core/rendering/svg_plot.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/numerics/error.h"

using namespace shaped;

namespace {

int occurrences(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

const PlotSeries rising{"shell", {1, 2, 3}, {10, 20, 40}};

}  // namespace

TEST_CASE("ticks are round and enclose the range") {
  CHECK(roundTicks(0, 1, 6) == std::vector<double>{0, 0.2, 0.4, 0.6000000000000001, 0.8, 1});
  CHECK(roundTicks(3, 47, 6) == std::vector<double>{0, 10, 20, 30, 40, 50});
  const auto ticks = roundTicks(-0.013, 0.021);
  CHECK(ticks.front() <= -0.013);
  CHECK(ticks.back() >= 0.021);
  const auto single = roundTicks(5, 5);
  CHECK(single.front() < 5);
  CHECK(single.back() > 5);
}

TEST_CASE("a plot holds a line per series, a dot per point, and a legend from two names on") {
  LinePlot plot{"Generalisation", "modes", "error [mm]", {rising, {"linear", {1, 2, 3}, {30, 35, 38}}}};
  const auto two = svgPlot(plot);
  CHECK(occurrences(two, "<path") == 2);
  CHECK(occurrences(two, "<circle") == 6);
  CHECK(occurrences(two, ">linear<") == 1);
  CHECK(occurrences(two, ">error [mm]<") == 1);
  plot.series.pop_back();
  CHECK(occurrences(svgPlot(plot), ">shell<") == 0);
}

TEST_CASE("larger values are drawn higher, between the axes") {
  const auto svg = svgPlot({"", "x", "y", {rising}});
  double first = 0, last = 0;
  const auto at = svg.find("<circle"), end = svg.rfind("<circle");
  REQUIRE(std::sscanf(svg.c_str() + at, "<circle cx=\"%*f\" cy=\"%lf", &first) == 1);
  REQUIRE(std::sscanf(svg.c_str() + end, "<circle cx=\"%*f\" cy=\"%lf", &last) == 1);
  CHECK(last == Approx(20));                // 40 is the last tick, at the upper edge
  CHECK(first == Approx(382 - 362 / 4.0));  // 10 of 40 above the lower edge, 440 - 58
}

TEST_CASE("a missing value breaks the line") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto svg = svgPlot({"", "x", "y", {{"", {1, 2, 3, 4, 5}, {1, 2, nan, 4, 5}}}});
  CHECK(occurrences(svg, "M") == 2);
  CHECK(occurrences(svg, "nan") == 0);
}

TEST_CASE("a logarithmic axis has powers of ten, equally far") {
  CHECK(decadeTicks(0.02, 30) == std::vector<double>{0.01, 0.1, 1, 10, 100});
  CHECK(decadeTicks(1, 1) == std::vector<double>{1, 10});
  const auto many = decadeTicks(1e-12, 2, 8);
  CHECK(many.size() <= 9);
  CHECK(many.front() == Approx(1e-12));
  CHECK(many.back() >= 2);
  LinePlot plot{"", "x", "y", {{"", {1, 2, 3, 4}, {1, 0.1, 0, 0.01}}}};
  plot.y_logarithmic = true;
  const auto svg = svgPlot(plot);
  CHECK(occurrences(svg, "<circle") == 3);
  CHECK(occurrences(svg, "M") == 2);  // broken where the value is 0
  double first = 0, second = 0;
  const auto at = svg.find("<circle"), next = svg.find("<circle", at + 1);
  REQUIRE(std::sscanf(svg.c_str() + at, "<circle cx=\"%*f\" cy=\"%lf", &first) == 1);
  REQUIRE(std::sscanf(svg.c_str() + next, "<circle cx=\"%*f\" cy=\"%lf", &second) == 1);
  CHECK(first == Approx(20));
  CHECK(second == Approx(20 + 362 / 2.0));
  plot.series[0].y = {1, 1e-3, 1e-4, 1e-5};
  CHECK(occurrences(svgPlot(plot), ">0.001<") == 1);
  CHECK(occurrences(svgPlot(plot), ">1e-4<") == 1);
  plot.series[0].y = {0, -1, 0, 0};
  CHECK_THROWS_WITH(svgPlot(plot), Catch::Contains("series[0]") && Catch::Contains("positive"));
}

TEST_CASE("names are escaped") {
  const auto svg = svgPlot({"a < b & \"c\"", "x", "y", {rising}});
  CHECK(occurrences(svg, "a &lt; b &amp; &quot;c&quot;") == 1);
}

TEST_CASE("a plot without points is refused by name") {
  CHECK_THROWS_WITH(svgPlot({}), Catch::Contains("series"));
  CHECK_THROWS_WITH(svgPlot({"", "", "", {rising, {"b", {1, 2}, {1}}}}), Catch::Contains("series[1]"));
  CHECK_THROWS_WITH(svgPlot({"", "", "", {{"b", {}, {}}}}), Catch::Contains("no point"));
  LinePlot tiny{"", "", "", {rising}};
  tiny.width = 10;
  CHECK_THROWS_AS(svgPlot(tiny), InvalidInput);
}
