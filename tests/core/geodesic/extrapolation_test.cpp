#include <catch2/catch.hpp>

#include "core/geodesic/balance_solver.h"
#include "core/geodesic/geodesic.h"
#include "core/mesh/alignment.h"
#include "core/shell/energy.h"
#include "tests/support/calculus.h"
#include "tests/support/literal_forces.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A straight tube and a bent, stretched, irregular one, a distance of about a third of the tube's length apart.
struct Setting {
  Mesh mesh = tube(9, 6);
  GeodesicCalculus calculus = calculusOn(mesh);
  Vertices a = mesh.vertices, b = moveRigidly(jitter(1.1 * bend(mesh.vertices, 1.2), 0.02, 5), 1);
  double size = rigidGap(a, b);

  Path path(int steps) const { return calculus.interpolate(a, b, steps, {}).solution; }
  /// I(path, t), which must converge.
  Vertices at(const Path& along, double t) const {
    const auto solved = calculus.at(along, t, {});
    INFO("t = " << t << ": " << name(solved.termination) << ", residual " << solved.residual);
    CHECK(solved.converged());
    return solved.solution;
  }
};

}  // namespace

TEST_CASE("extrapolating an interpolated path returns its end, and backwards its beginning") {
  const Setting s;
  for (const int steps : {2, 3, 5, 8}) {
    INFO("K = " << steps);
    const auto path = s.path(steps);
    for (std::size_t k = 2; k < path.size(); ++k) {
      const auto next = s.calculus.extrapolate(path[k - 2], path[k - 1], {});
      REQUIRE(next.converged());
      CHECK(rigidGap(next.solution, path[k]) < 5e-8 * s.size);
      const auto previous = s.calculus.extrapolateBackwards(path[k - 1], path[k], {});
      REQUIRE(previous.converged());
      CHECK(rigidGap(previous.solution, path[k - 2]) < 5e-8 * s.size);
    }
    Vertices before = path[0], here = path[1];  // the whole path from its first two shapes
    for (int k = 1; k < steps; ++k) {
      Vertices next = s.calculus.extrapolate(before, here, {}).solution;
      before = std::move(here);
      here = std::move(next);
    }
    CHECK(rigidGap(here, s.b) < 1e-6 * s.size);  // errors of 1e-8 grow along the way
  }
}

TEST_CASE("extrapolated shapes balance the literal forces (23) on both sides") {
  const Setting s;
  const auto path = s.path(2);
  const auto next = s.calculus.extrapolate(path[1], path[2], {});
  const auto previous = s.calculus.extrapolateBackwards(path[0], path[1], {});
  REQUIRE(next.converged());
  REQUIRE(previous.converged());
  CHECK(next.residual <= 1e-8);
  CHECK(literalPathImbalance(*s.mesh.topology, {path[1], path[2], next.solution}, s.calculus.bending()) < 2e-8);
  CHECK(literalPathImbalance(*s.mesh.topology, {previous.solution, path[0], path[1]}, s.calculus.bending()) < 2e-8);
}

TEST_CASE("I(a, b, t): nodes at multiples of 1/K, and both ends") {
  const Setting s;
  for (const int steps : {1, 2, 3, 5}) {
    const auto path = s.path(steps);
    for (int k = 0; k <= steps; ++k)
      CHECK(s.at(path, static_cast<double>(k) / steps) == path[static_cast<std::size_t>(k)]);
    CHECK(rigidGap(s.at(path, 1 + 1.0 / steps),
                   s.calculus.extrapolate(path[path.size() - 2], path.back(), {}).solution) < 1e-9);
    CHECK(rigidGap(s.at(path, -1.0 / steps), s.calculus.extrapolateBackwards(path[0], path[1], {}).solution) < 1e-9);
  }
}

TEST_CASE("between nodes I(a, b, t) minimises (24) and runs continuously through the nodes") {
  const Setting s;
  const auto path = s.path(2);
  const auto& topology = *s.mesh.topology;
  const double eta = s.calculus.bending();
  for (const double t : {0.1, 0.25, 0.45, 0.8}) {
    const Vertices x = s.at(path, t);
    const double inner = 2 * t - std::floor(2 * t);
    const auto& below = path[static_cast<std::size_t>(std::floor(2 * t))];
    const auto& above = path[static_cast<std::size_t>(std::floor(2 * t)) + 1];
    INFO("t = " << t);
    CHECK(relativeImbalance({(1 - inner) * literalSecondForce(topology, below, x, eta),
                             inner * literalFirstForce(topology, x, above, eta)}) < 2e-8);
  }
  for (const double node : {-0.5, 0.0, 0.5, 1.0, 1.5})
    for (const double h : {1e-3, 1e-6}) {
      const Vertices on = s.at(path, node);
      INFO("node " << node << ", step " << h);
      CHECK(rigidGap(s.at(path, node - h), on) < 3 * h * s.size);
      CHECK(rigidGap(s.at(path, node + h), on) < 3 * h * s.size);
      CHECK(rigidGap(s.at(path, node + h), on) > 0.2 * h * s.size);
    }
}

TEST_CASE("through() undoes between(): the far end follows from the near one and a shape on the way") {
  const Setting s;
  for (const double t : {0.02, 0.1, 0.5, 0.9, 1.0}) {
    INFO("t = " << t);
    const auto inner = s.calculus.between(s.a, s.b, t, {});
    REQUIRE(inner.converged());
    const auto far = s.calculus.through(s.a, inner.solution, t, {});
    REQUIRE(far.converged());
    CHECK(rigidGap(far.solution, s.b) < 1e-6 * s.size / t);
  }
}

TEST_CASE("I(a, b, t) bends a tube by t times the angle, between and beyond the ends") {
  const auto pipe = tube(13, 8);
  const auto calculus = calculusOn(pipe);
  const Vertices bent = bend(pipe.vertices, 1.2);
  const double size = rigidGap(pipe.vertices, bent);
  const auto path = calculus.interpolate(pipe.vertices, moveRigidly(bent, 7), 4, {}).solution;
  for (const double t : {-1.0, -0.6, 0.3, 0.5, 0.9, 1.3, 2.0}) {
    INFO("t = " << t);
    const auto solved = calculus.at(path, t, {});
    REQUIRE(solved.converged());
    CHECK(rigidGap(solved.solution, bend(pipe.vertices, 1.2 * t)) < 0.06 * size);
  }
}

TEST_CASE("the reflection of a reflection: exact through the same equation, else with an error that falls as K grows") {
  const Setting s;
  std::vector<double> errors;
  for (const int steps : {1, 2, 4}) {
    const auto path = s.path(steps);
    const Vertices reflected = s.at(path, -1);
    // the path from the reflection through a runs on to b: the same equations solved forwards
    Path extended{reflected};
    for (int k = 1; k < steps; ++k) extended.push_back(s.at(path, -1 + static_cast<double>(k) / steps));
    extended.push_back(s.a);
    CHECK(rigidGap(s.at(extended, 2), s.b) < 1e-6 * s.size);
    // I(a, I(a, b, -1), -1) runs the segments the other way, where W differs in third order
    errors.push_back(rigidGap(s.at(s.calculus.interpolate(s.a, reflected, steps, {}).solution, -1), s.b) / s.size);
  }
  CHECK(errors[0] < 0.1);
  for (std::size_t k = 1; k < errors.size(); ++k) CHECK(order(errors[k - 1], errors[k]) > 0.8);
}

TEST_CASE("reflections of far shapes converge: tubes bent by 2 radians in one, two and four steps") {
  const auto pipe = tube(13, 8);
  const auto calculus = calculusOn(pipe);
  const Vertices b = bend(pipe.vertices, 2);
  for (const int steps : {1, 2, 4}) {
    const auto path = calculus.interpolate(pipe.vertices, b, steps, {}).solution;
    const auto reflected = calculus.at(path, -1, {});
    INFO("K = " << steps << ", " << name(reflected.termination));
    REQUIRE(reflected.converged());
    CHECK(rigidGap(reflected.solution, bend(pipe.vertices, -2)) < 0.1 * rigidGap(pipe.vertices, b));
  }
}

TEST_CASE("rigid motions of the path's shapes do not change what is extrapolated") {
  const Setting s;
  const auto path = s.path(2);
  Path moved;
  for (std::size_t k = 0; k < path.size(); ++k) moved.push_back(moveRigidly(path[k], 20 + static_cast<unsigned>(k)));
  for (const double t : {-0.7, 0.2, 0.9, 1.6}) CHECK(rigidGap(s.at(moved, t), s.at(path, t)) < 1e-7 * s.size);
}

TEST_CASE("extrapolation that cannot succeed says so and returns a finite shape") {
  const Setting s;
  SECTION("cancelled") {
    std::stop_source source;
    source.request_stop();
    const auto next = s.calculus.extrapolate(s.a, s.b, {100, 1e-8, source.get_token()});
    CHECK(next.termination == Termination::kCancelled);
    const auto path = s.path(2);
    CHECK(s.calculus.at(path, 3, {100, 1e-8, source.get_token()}).termination == Termination::kCancelled);
    CHECK(s.calculus.at(path, 0.3, {100, 1e-8, source.get_token()}).termination == Termination::kCancelled);
  }
  SECTION("iteration limit") {
    const auto next = s.calculus.extrapolate(s.a, s.b, {1, 1e-14, {}});
    CHECK(next.termination != Termination::kConverged);
    CHECK(next.residual > 1e-14);
    CHECK(next.solution.allFinite());
  }
  SECTION("forces that no shape answers: the residual is that of the shape returned") {
    Vertices crushed = s.a;  // a third of its length: reflected it would have to be turned inside out
    crushed.col(0) *= 0.02;
    const auto next = s.calculus.extrapolate(2.5 * s.a, crushed, {30, 1e-8, {}});
    CHECK_FALSE(next.converged());
    REQUIRE(next.solution.allFinite());
    CHECK(next.residual > 1e-8);
    const double literal =
        literalPathImbalance(*s.mesh.topology, {2.5 * s.a, crushed, next.solution}, s.calculus.bending());
    CHECK(next.residual == Approx(literal).epsilon(0.3));
  }
}
