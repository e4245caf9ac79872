#include "core/mesh/alignment.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "core/numerics/error.h"

using namespace shaped;

namespace {

Vertices randomPoints(int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  return Vertices::NullaryExpr(count, 3, [&] { return normal(generator); });
}

RigidMotion someMotion() {
  return {Eigen::AngleAxisd(2.3, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix(), {0.3, -1.2, 4.0}};
}

double misfit(const RigidMotion& motion, const Vertices& source, const Vertices& target) {
  return (apply(motion, source) - target).squaredNorm();
}

}  // namespace

TEST_CASE("alignment recovers a rigid motion exactly") {
  const Vertices source = randomPoints(20, 1);
  const auto motion = someMotion();
  const auto found = alignRigidly(source, apply(motion, source));
  CHECK((found.rotation - motion.rotation).norm() < 1e-13);
  CHECK((found.translation - motion.translation).norm() < 1e-12);
  CHECK((apply(inverse(found), apply(motion, source)) - source).norm() < 1e-12);
}

TEST_CASE("no small turn or shift fits noisy points better") {
  const Vertices source = randomPoints(30, 2), target = apply(someMotion(), source) + 0.3 * randomPoints(30, 3);
  const auto best = alignRigidly(source, target);
  for (int axis = 0; axis < 3; ++axis)
    for (const double step : {-1e-3, 1e-3}) {
      auto turned = best, shifted = best;
      turned.rotation = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(axis)) * best.rotation;
      shifted.translation[axis] += step;
      CHECK(misfit(turned, source, target) > misfit(best, source, target));
      CHECK(misfit(shifted, source, target) > misfit(best, source, target));
    }
}

TEST_CASE("a mirrored target still gets a proper rotation") {
  const Vertices source = randomPoints(20, 4);
  Vertices target = source;
  target.col(0) *= -1;
  const auto motion = alignRigidly(source, target);
  CHECK(motion.rotation.determinant() == Approx(1));
  CHECK((motion.rotation * motion.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-13);
}

TEST_CASE("points in a plane determine the rotation") {
  Vertices source = randomPoints(10, 5);
  source.col(2).setZero();
  CHECK((alignRigidly(source, apply(someMotion(), source)).rotation - someMotion().rotation).norm() < 1e-12);
}

TEST_CASE("points on a line or in one place get the smallest rotation") {
  Vertices line = Vertices::Zero(4, 3), turned = Vertices::Zero(4, 3);
  line.col(0) << 0, 1, 2, 5;
  turned.col(1) = line.col(0);
  const auto quarter = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  CHECK((alignRigidly(line, turned).rotation - quarter).norm() < 1e-12);
  CHECK(alignRigidly(line, line).rotation.isApprox(Eigen::Matrix3d::Identity()));
  const auto reversed = alignRigidly(line, -line);
  CHECK(reversed.rotation.determinant() == Approx(1));
  CHECK((apply(reversed, line) + line).norm() < 1e-12);
  const Vertices point = Vertices::Constant(3, 3, 2.0);
  const auto moved = alignRigidly(point, (point.array() + 1).matrix());
  CHECK(moved.rotation == Eigen::Matrix3d::Identity());
  CHECK(moved.translation.isApprox(Eigen::Vector3d::Ones()));
}

TEST_CASE("weights choose the points that count") {
  const Vertices source = randomPoints(12, 6);
  Vertices target = apply(someMotion(), source);
  target.row(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  target.row(7).array() += 10;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(12);
  weights[3] = weights[7] = 0;
  CHECK((alignRigidly(source, target, weights).rotation - someMotion().rotation).norm() < 1e-12);
  weights[7] = 1;  // the control: now the displaced point pulls
  CHECK((alignRigidly(source, target, weights).rotation - someMotion().rotation).norm() > 1e-3);
}

TEST_CASE("a doubled weight counts like a doubled point") {
  const Vertices source = randomPoints(6, 7), target = randomPoints(6, 8);
  Vertices more_source(7, 3), more_target(7, 3);
  more_source << source, source.row(2);
  more_target << target, target.row(2);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(6);
  weights[2] = 2;
  const auto weighted = alignRigidly(source, target, weights), repeated = alignRigidly(more_source, more_target);
  CHECK((weighted.rotation - repeated.rotation).norm() < 1e-12);
  CHECK((weighted.translation - repeated.translation).norm() < 1e-12);
}

TEST_CASE("similarity alignment recovers the scale") {
  const Vertices source = randomPoints(15, 9);
  const SimilarityMotion motion{0.37, someMotion().rotation, someMotion().translation};
  const auto found = alignSimilarly(source, apply(motion, source));
  CHECK(found.scale == Approx(0.37).epsilon(1e-12));
  CHECK((found.rotation - motion.rotation).norm() < 1e-12);
  CHECK((found.translation - motion.translation).norm() < 1e-12);
  CHECK(alignSimilarly(Vertices::Zero(3, 3), source.topRows(3)).scale == 1);
  CHECK(alignSimilarly(source.topRows(3), Vertices::Zero(3, 3)).scale == 0);
}

TEST_CASE("alignment refuses what it cannot read, by name") {
  const Vertices points = randomPoints(4, 10);
  Vertices broken = points;
  broken(2, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(alignRigidly(points, points.topRows(3)), Catch::Contains("target: has 3 points, want 4"));
  CHECK_THROWS_WITH(alignRigidly(points, broken), Catch::Contains("target[2]: is not finite"));
  CHECK_THROWS_WITH(alignRigidly(broken, points), Catch::Contains("source[2]: is not finite"));
  CHECK_THROWS_WITH(alignRigidly(points, points, Eigen::VectorXd::Ones(3)), Catch::Contains("weights: has 3 values"));
  CHECK_THROWS_WITH(alignRigidly(points, points, -Eigen::VectorXd::Ones(4)), Catch::Contains("weights[0]"));
  CHECK_THROWS_WITH(alignRigidly(points, points, Eigen::VectorXd::Zero(4)), Catch::Contains("weights: are all zero"));
  CHECK_THROWS_AS(alignRigidly(Vertices(0, 3), Vertices(0, 3)), InvalidInput);
}
