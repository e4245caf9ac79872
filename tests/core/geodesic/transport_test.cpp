#include <catch2/catch.hpp>

#include "core/geodesic/geodesic.h"
#include "core/mesh/alignment.h"
#include "core/shell/energy.h"
#include "tests/support/calculus.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Vertices transported(const GeodesicCalculus& calculus, const Path& path, const Vertices& displaced) {
  const auto solved = calculus.transport(path, displaced, {});
  INFO(name(solved.termination) << ", residual " << solved.residual);
  REQUIRE(solved.converged());
  return solved.solution;
}

/// sqrt(W): how far two near shapes are apart.
double apart(const GeodesicCalculus& calculus, const Vertices& a, const Vertices& b) {
  return std::sqrt(shellEnergy(calculus.topology(), a, b, calculus.bending()));
}

/// Two bent, stretched tubes and a small variation of the first.
struct Setting {
  Mesh mesh = tube(9, 6);
  GeodesicCalculus calculus = calculusOn(mesh);
  Vertices a = bend(mesh.vertices, -0.6), b = moveRigidly(1.05 * bend(mesh.vertices, 0.8), 2);
  Vertices variation(double size) const {
    Vertices shape = mesh.vertices;
    shape.col(2) *= 1 + size;  // flatter
    return bend(shape, -0.6);
  }
};

}  // namespace

TEST_CASE("a geodesic's own velocity is carried to its own velocity") {
  // each rung of the ladder has its two middle shapes in one, so the geodesic's own equation (23) carries it on
  const Setting s;
  for (const int steps : {2, 4, 8}) {
    const auto path = s.calculus.interpolate(s.a, s.b, steps, {}).solution;
    const Vertices carried = transported(s.calculus, path, path[1]);
    const Vertices expected = s.calculus.at(path, 1 + 1.0 / steps, {}).solution;
    CHECK(rigidGap(carried, expected) < 1e-4 * rigidGap(path[0], path[1]));
  }
}

TEST_CASE("there and back again returns the variation, the better the more steps") {
  const Setting s;
  std::vector<double> errors;
  for (const int steps : {2, 4, 8}) {
    const auto path = s.calculus.interpolate(s.a, s.b, steps, {}).solution;
    const Path back(path.rbegin(), path.rend());
    const Vertices start = s.variation(0.2 / steps);
    const Vertices returned = transported(s.calculus, back, transported(s.calculus, path, start));
    errors.push_back(rigidGap(returned, start) / rigidGap(start, s.a));
  }
  CHECK(errors[0] < 0.1);
  for (std::size_t k = 1; k < errors.size(); ++k) CHECK(order(errors[k - 1], errors[k]) > 0.8);
}

TEST_CASE("the zero variation is carried to the zero variation, and lengths are kept") {
  const Setting s;
  const auto path = s.calculus.interpolate(s.a, s.b, 6, {}).solution;
  CHECK(rigidGap(transported(s.calculus, path, path.front()), path.back()) < 1e-7);
  for (const double size : {0.02, 0.04}) {
    const Vertices start = s.variation(size);
    const Vertices carried = transported(s.calculus, path, start);
    CHECK(apart(s.calculus, path.back(), carried) == Approx(apart(s.calculus, path.front(), start)).epsilon(0.05));
  }
}

TEST_CASE("carrying is linear for small variations") {
  const Setting s;
  const auto path = s.calculus.interpolate(s.a, s.b, 6, {}).solution;
  const auto offsetAfter = [&](double size) {
    const Vertices carried = transported(s.calculus, path, s.variation(size));
    return Vertices(apply(alignRigidly(carried, path.back()), carried) - path.back());
  };
  const Vertices small = offsetAfter(0.005), large = offsetAfter(0.01), opposite = offsetAfter(-0.005);
  CHECK((large - 2 * small).norm() < 0.05 * large.norm());
  CHECK((opposite + small).norm() < 0.1 * small.norm());
}

TEST_CASE("where nothing bends, transport is translation: stretches of a flat sheet add up") {
  // Sheets stretched along x and y by (p, q): the membrane metric couples the logarithms only weakly for small
  // stretches
  const auto sheet = grid(5);
  const auto calculus = calculusOn(sheet);
  const auto stretched = [&](double p, double q) {
    Vertices shape = sheet.vertices;
    shape.col(0) *= 1 + p;
    shape.col(1) *= 1 + q;
    return shape;
  };
  const double p = 0.04, q = 0.03;
  const auto path = calculus.interpolate(stretched(0, 0), stretched(p, 0), 4, {}).solution;
  const Vertices carried = transported(calculus, path, stretched(0, q));
  CHECK(rigidGap(carried, stretched(p, q)) < 0.05 * rigidGap(stretched(0, 0), stretched(0, q)));
  CHECK(rigidGap(carried, stretched(p, 0)) > 0.8 * rigidGap(stretched(0, 0), stretched(0, q)));
}

TEST_CASE("transport that is told to stop says so") {
  const Setting s;
  const auto path = s.calculus.interpolate(s.a, s.b, 4, {}).solution;
  std::stop_source source;
  source.request_stop();
  CHECK(s.calculus.transport(path, path[1], {100, 1e-8, source.get_token()}).termination == Termination::kCancelled);
}
