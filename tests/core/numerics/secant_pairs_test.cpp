#include "core/numerics/secant_pairs.h"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <vector>

using namespace shaped;

namespace {

constexpr Eigen::Index kSize = 7;

Eigen::MatrixXd randomPositive() {
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(kSize, kSize);
  return root * root.transpose() + Eigen::MatrixXd::Identity(kSize, kSize);
}

/// One update of the whole matrix, (6.17) of Nocedal and Wright.
Eigen::MatrixXd updated(const Eigen::MatrixXd& inverse, const Eigen::VectorXd& step, const Eigen::VectorXd& change) {
  const double rho = 1 / step.dot(change);
  const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(kSize, kSize) - rho * step * change.transpose();
  return left * inverse * left.transpose() + rho * step * step.transpose();
}

}  // namespace

TEST_CASE("the limited-memory product is that of the BFGS matrix of the last pairs") {
  std::srand(5);
  const Eigen::MatrixXd initial = randomPositive(), hessian = randomPositive();
  const auto start = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd { return initial * v; };
  SecantPairs pairs(3);
  std::vector<Eigen::VectorXd> steps;
  for (int k = 0; k < 5; ++k) {
    steps.emplace_back(Eigen::VectorXd::Random(kSize));
    pairs.add(steps.back(), hessian * steps.back());
  }
  CHECK(pairs.size() == 3);
  Eigen::MatrixXd dense = initial;
  for (std::size_t k = 2; k < 5; ++k) dense = updated(dense, steps[k], hessian * steps[k]);
  const Eigen::VectorXd gradient = Eigen::VectorXd::Random(kSize);
  CHECK((pairs.multiply(start, gradient) - dense * gradient).norm() < 1e-12 * gradient.norm());
  // The last pair is met exactly.
  CHECK((pairs.multiply(start, hessian * steps.back()) - steps.back()).norm() < 1e-11);
}

TEST_CASE("without pairs the limited-memory product is the initial one, and negative curvature makes no pair") {
  SecantPairs pairs(2);
  const Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(kSize, 1, 2);
  const auto twice = [](const Eigen::VectorXd& x) -> Eigen::VectorXd { return 2 * x; };
  CHECK(pairs.multiply(twice, v) == 2 * v);
  pairs.add(v, -v);
  pairs.add(v, Eigen::VectorXd::Zero(kSize));
  CHECK(pairs.size() == 0);
  pairs.add(v, v);
  CHECK(pairs.size() == 1);
  pairs.clear();
  CHECK(pairs.multiply(twice, v) == 2 * v);
}
