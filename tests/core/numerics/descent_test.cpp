#include "core/numerics/descent.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <limits>

using namespace shaped;

namespace {

/// Rosenbrock's valley with the minimum 0 at (1, 1).
double valley(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  const double a = 1 - x[0], b = x[1] - x[0] * x[0];
  gradient.resize(2);
  gradient << -2 * a - 400 * x[0] * b, 200 * b;
  return a * a + 100 * b * b;
}

}  // namespace

TEST_CASE("the BFGS method finds the end of a curved valley and learns the inverse Hessian there") {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(2, 2);
  const auto solved = minimiseBfgs(valley, Eigen::Vector2d(-1.2, 1), inverse, {.tolerance = 1e-9, .reference = 1});
  REQUIRE(solved.converged());
  CHECK((solved.solution - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  CHECK(solved.residual <= 1e-9);
  Eigen::Matrix2d hessian;
  hessian << 802, -400, -400, 200;
  CHECK((inverse * hessian - Eigen::Matrix2d::Identity()).norm() < 0.05);
  // what was learnt makes the next start a short one
  const auto again = minimiseBfgs(valley, Eigen::Vector2d(1.001, 1.002), inverse, {.tolerance = 1e-9, .reference = 1});
  CHECK(again.converged());
  CHECK(again.iterations < solved.iterations / 3);
}

TEST_CASE("with the exact inverse Hessian a quadratic is minimised in one step") {
  const Eigen::MatrixXd factor = Eigen::MatrixXd::Random(12, 12);
  const Eigen::MatrixXd hessian = factor * factor.transpose() + Eigen::MatrixXd::Identity(12, 12);
  const Eigen::VectorXd minimum = Eigen::VectorXd::Random(12);
  const auto quadratic = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = hessian * (x - minimum);
    return 0.5 * (x - minimum).dot(gradient);
  };
  Eigen::MatrixXd inverse = hessian.inverse();
  const auto solved = minimiseBfgs(quadratic, Eigen::VectorXd::Zero(12), inverse, {.tolerance = 1e-10, .reference = 1});
  CHECK(solved.converged());
  CHECK(solved.iterations == 1);
  CHECK((solved.solution - minimum).norm() < 1e-10);
}

TEST_CASE("the BFGS method steps back from where a function is not defined, and says how it ended") {
  const auto barrier = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = Eigen::VectorXd::Constant(1, 1 - 0.01 / x[0]);
    return x[0] > 0 ? x[0] - 0.01 * std::log(x[0]) : std::numeric_limits<double>::infinity();
  };
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Constant(1, 1, 10);
  const auto solved = minimiseBfgs(barrier, Eigen::VectorXd::Ones(1), inverse, {.tolerance = 1e-8, .reference = 1});
  CHECK(solved.converged());
  CHECK(solved.solution[0] == Approx(0.01).epsilon(1e-6));
  inverse.setConstant(0.1);
  CHECK(minimiseBfgs(barrier, Eigen::VectorXd::Ones(1), inverse, {.max_iterations = 1, .reference = 1}).termination ==
        Termination::kIterationLimit);
  const auto nowhere = minimiseBfgs(barrier, -Eigen::VectorXd::Ones(1), inverse, {});
  CHECK(nowhere.termination == Termination::kNumericalFailure);
  CHECK(nowhere.solution[0] == -1);
  std::stop_source stop;
  stop.request_stop();
  CHECK(minimiseBfgs(barrier, Eigen::VectorXd::Ones(1), inverse, {.stop = stop.get_token()}).termination ==
        Termination::kCancelled);
}

TEST_CASE("Newton's method finds the end of a curved valley in few steps and a quadratic's in one") {
  const auto curvature = [](const Eigen::VectorXd& x) {
    Eigen::MatrixXd hessian(2, 2);
    hessian << 2 + 800 * x[0] * x[0], -400 * x[0], -400 * x[0], 200;  // without the indefinite part
    return hessian;
  };
  const auto solved = minimiseNewton(valley, curvature, Eigen::Vector2d(-1.2, 1), {.tolerance = 1e-9, .reference = 1});
  REQUIRE(solved.converged());
  CHECK((solved.solution - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  CHECK(solved.iterations < 20);
  const auto flat = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient.setZero(2);
    gradient[0] = 2 * (x[0] - 3);
    return (x[0] - 3) * (x[0] - 3);
  };
  const auto singular = [](const Eigen::VectorXd&) -> Eigen::MatrixXd { return Eigen::Vector2d(2, 0).asDiagonal(); };
  const auto once = minimiseNewton(flat, singular, Eigen::Vector2d(0, 5), {.tolerance = 1e-6, .reference = 1});
  CHECK(once.converged());
  CHECK(once.solution[0] == Approx(3).epsilon(1e-6));
  CHECK(once.solution[1] == Approx(5));
}
