#include "core/editing/projection_accelerator.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/support/submanifolds.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const Submanifold& tubeManifold(int modes) { return *tubeSubmanifold(modes); }

/// A slow linear contraction y -> fixed + a (y - fixed).
struct Iteration {
  Eigen::VectorXd fixed = Eigen::Vector3d(0.3, -0.2, 0.1);
  Eigen::MatrixXd a = (Eigen::Matrix3d() << 0.95, 0.02, 0, 0.01, 0.9, 0.03, 0, 0.02, 0.7).finished();

  Eigen::VectorXd operator()(const Eigen::VectorXd& y) const { return fixed + a * (y - fixed); }
};

}  // namespace

TEST_CASE("the accelerator finds the fixed point of a linear iteration from as many steps as there are modes") {
  const auto& manifold = tubeManifold(3);
  const Iteration iteration;
  ProjectionAccelerator accelerator(manifold);
  CHECK(!accelerator.propose());
  Eigen::VectorXd y = iteration.fixed + Eigen::Vector3d(0.05, -0.04, 0.03);
  const double start = (y - iteration.fixed).norm();
  for (int step = 0; step < 4; ++step) {
    const Eigen::VectorXd next = iteration(y);
    accelerator.add({manifold.pointOf(y)}, {manifold.pointOf(next)});
    y = next;
  }
  const auto proposed = accelerator.propose();
  REQUIRE(proposed);
  CHECK((manifold.tangentCoordinates(proposed->point) - iteration.fixed).norm() < 1e-6 * start);
  CHECK((y - iteration.fixed).norm() > 0.5 * start);  // the control: plain steps are still far
  CHECK(proposed->point.alpha.minCoeff() >= 0);
  CHECK(proposed->point.alpha.sum() == Approx(1));
}

TEST_CASE("a further unknown that is coupled to the coordinates is accelerated with them") {
  const auto& manifold = tubeManifold(2);
  const Iteration iteration;  // of two coordinates and the unknown
  ProjectionAccelerator accelerator(manifold);
  const auto stateOf = [&](const Eigen::VectorXd& z) {
    return ProjectionAccelerator::State{manifold.pointOf(z.head(2)), z[2]};
  };
  Eigen::VectorXd z = iteration.fixed + Eigen::Vector3d(0.05, -0.04, 0.03);
  for (int step = 0; step < 4; ++step) {
    const Eigen::VectorXd next = iteration(z);
    accelerator.add(stateOf(z), stateOf(next));
    z = next;
  }
  const auto proposed = accelerator.propose();
  REQUIRE(proposed);
  CHECK(proposed->extra == Approx(iteration.fixed[2]).epsilon(1e-6));
  CHECK((manifold.tangentCoordinates(proposed->point) - iteration.fixed.head(2)).norm() < 1e-6);
}

TEST_CASE("a proposal that crosses the mean changes to the reflected variation") {
  const auto& manifold = tubeManifold(2);
  ProjectionAccelerator accelerator(manifold);
  const Eigen::Vector2d direction(1, 0.25);  // towards coordinates below zero with steps that halve
  Eigen::Vector2d y(0.30, 0.2);
  double length = 0.16;
  for (int step = 0; step < 2; ++step, length *= 0.9) {
    const Eigen::Vector2d next = y - length * direction;
    accelerator.add({manifold.pointOf(y)}, {manifold.pointOf(next)});
    y = next;
  }
  const auto proposed = accelerator.propose();
  REQUIRE(proposed);
  const Eigen::VectorXd expected = y - length / 0.1 * direction;  // the geometric series' limit
  CHECK(expected.maxCoeff() < 0);
  CHECK((manifold.tangentCoordinates(proposed->point) - expected).norm() < 1e-9);
}

TEST_CASE("a proposal is at most thirty steps away, and what was forgotten does not count") {
  const auto& manifold = tubeManifold(2);
  ProjectionAccelerator accelerator(manifold);
  Eigen::Vector2d y(0.1, 0.1);
  for (const double length : {1e-3, 0.9999e-3}) {  // a limit ten thousand steps away
    const Eigen::Vector2d next = y + Eigen::Vector2d(length, 0);
    accelerator.add({manifold.pointOf(y)}, {manifold.pointOf(next)});
    y = next;
  }
  const auto proposed = accelerator.propose();
  REQUIRE(proposed);
  CHECK((manifold.tangentCoordinates(proposed->point) - y).norm() == Approx(30 * 0.9999e-3).epsilon(1e-6));
  accelerator.forget();
  CHECK(!accelerator.propose());
}
