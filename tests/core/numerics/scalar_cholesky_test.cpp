#include "core/numerics/scalar_cholesky.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <thread>

using namespace shaped;

namespace {

/// Sparse and diagonally dominant.
Eigen::SparseMatrix<double> randomPositive(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> index(0, n - 1);
  std::uniform_real_distribution<double> value(-1, 1);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (int k = 0; k < 3 * n; ++k) {
    const int i = index(random), j = index(random);
    dense(i, j) = dense(j, i) = value(random);
  }
  dense.diagonal() = dense.cwiseAbs().rowwise().sum().array() + 0.5;
  return dense.sparseView();
}

}  // namespace

TEST_CASE("the scalar factor solves like a dense one, whatever stands in the upper triangle") {
  for (const int n : {1, 7, 150}) {
    const auto matrix = randomPositive(n, 1);
    const Eigen::MatrixXd b = Eigen::MatrixXd::Random(n, 3);
    const Eigen::MatrixXd expected = Eigen::MatrixXd(matrix).llt().solve(b);
    ScalarCholesky factor;
    REQUIRE(factor.compute(matrix));
    CHECK((factor.solve(b) - expected).norm() < 1e-13 * expected.norm());
    CHECK(factor.bytes() >= static_cast<std::size_t>(n) * sizeof(double));
    ScalarCholesky lower;
    REQUIRE(lower.compute(matrix.triangularView<Eigen::Lower>()));
    CHECK((lower.solve(b) - expected).norm() < 1e-13 * expected.norm());
  }
}

TEST_CASE("a scalar factor refuses indefinite and non-finite matrices, and takes another one afterwards") {
  const auto good = randomPositive(40, 2);
  ScalarCholesky factor;
  for (const double bad : {-3.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto matrix = good;
    matrix.coeffRef(17, 17) = bad;
    CHECK_FALSE(factor.compute(matrix));
  }
  REQUIRE(factor.compute(good));
  const Eigen::VectorXd b = Eigen::VectorXd::Ones(40);
  CHECK((good * factor.solve(b).col(0) - b).norm() < 1e-12);
  std::stop_source stop;
  stop.request_stop();
  CHECK_FALSE(factor.compute(good, stop.get_token()));
}

TEST_CASE("one scalar factor serves several threads at once and can be moved") {
  const auto matrix = randomPositive(200, 3);
  ScalarCholesky made;
  REQUIRE(made.compute(matrix));
  const ScalarCholesky factor(std::move(made));
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(200, 4);
  Eigen::MatrixXd together(200, 4);
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (int repeat = 0; repeat < 50; ++repeat) together.col(t) = factor.solve(b.col(t));
      });
  }
  for (int t = 0; t < 4; ++t) CHECK((together.col(t) - factor.solve(b.col(t))).norm() == 0);
}
