#include "core/curve/trajectory_filters.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// One vertex in every frame, at these places on the x axis.
Curve pointsOnLine(const std::vector<double>& places, bool closed = false) {
  Curve curve{{}, closed};
  for (const double x : places) {
    curve.frames.push_back(Vertices::Zero(1, 3));
    curve.frames.back()(0, 0) = x;
  }
  return curve;
}

}  // namespace

TEST_CASE("linear averaging keeps even motion, spreads a spike and holds the ends") {
  const auto even = averagedLinearly(pointsOnLine({0, 1, 2, 3, 4}), 7, 0.8);
  for (std::size_t i = 0; i < 5; ++i) CHECK(even.frames[i](0, 0) == Approx(double(i)).margin(1e-14));
  const auto spike = averagedLinearly(pointsOnLine({0, 0, 1, 0, 0}), 1, 0.4);
  CHECK(spike.frames[1](0, 0) == Approx(0.2));
  CHECK(spike.frames[2](0, 0) == Approx(0.6));
  const auto ends = averagedLinearly(pointsOnLine({5, 0, 0, 7}), 1, 1);
  CHECK(ends.frames[0](0, 0) == 5);
  CHECK(ends.frames[1](0, 0) == 2.5);
  CHECK(ends.frames[3](0, 0) == 7);
  // in a closed curve the ends are neighbours
  const auto closed = averagedLinearly(pointsOnLine({3, 0, 0, 1}, true), 1, 1);
  CHECK(closed.frames[0](0, 0) == 0.5);
  CHECK(closed.frames[3](0, 0) == 1.5);
}

TEST_CASE("bilateral filtering is a Gaussian in time where distance does not matter, and keeps jumps where it does") {
  const auto gaussian = filteredBilaterally(pointsOnLine({0, 0, 0, 1, 0, 0, 0}), 1, kInfinite);
  const double total = 1 + 2 * (std::exp(-0.5) + std::exp(-2.0) + std::exp(-4.5));
  CHECK(gaussian.frames[3](0, 0) == Approx(1 / total));
  const double beside = std::exp(-0.5) / (total - std::exp(-4.5));
  CHECK(gaussian.frames[2](0, 0) == Approx(beside));
  const auto jump = filteredBilaterally(pointsOnLine({0, 0.1, 0, 10, 10.1, 10}), 2, 0.5);
  CHECK(jump.frames[2](0, 0) < 0.1);
  CHECK(jump.frames[3](0, 0) > 9.9);
  CHECK(jump.frames[1](0, 0) < 0.1);
  const auto closed = filteredBilaterally(pointsOnLine({1, 0, 0, 0, 0, 0, 0}, true), 1, kInfinite);
  CHECK(closed.frames[6](0, 0) == Approx(closed.frames[1](0, 0)));
}

TEST_CASE("filters of trajectories shrink what turns") {
  const auto mesh = tube(6, 6);
  Curve turning{{}, true};
  for (int i = 0; i < 24; ++i) {
    const double phase = 2 * 3.14159265358979 * i / 24;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn << std::cos(phase), -std::sin(phase), 0, std::sin(phase), std::cos(phase), 0, 0, 0, 1;
    turning.frames.push_back(mesh.vertices * turn.transpose());
  }
  const auto length = [](const Vertices& shape) {
    return (shape.colwise().maxCoeff() - shape.colwise().minCoeff()).norm();
  };
  // a circle's heat flow: each step with tau = 1 multiplies its radius by the cosine of the angle between frames
  const auto linear = averagedLinearly(turning, 4, 1);
  CHECK(linear.frames[0].norm() < turning.frames[0].norm());
  CHECK(linear.frames[0].leftCols<2>().norm() ==
        Approx(turning.frames[0].leftCols<2>().norm() * std::pow(std::cos(2 * 3.14159265358979 / 24), 4)));
  CHECK(length(filteredBilaterally(turning, 2, kInfinite).frames[0]) < 0.95 * length(turning.frames[0]));
}
