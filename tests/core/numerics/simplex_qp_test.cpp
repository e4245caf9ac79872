#include "core/numerics/simplex_qp.h"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

using namespace shaped;

namespace {

/// The nearest point of the unit simplex: shift all entries by one number and cut at zero.
Eigen::VectorXd nearestOnSimplex(const Eigen::VectorXd& x) {
  double low = x.minCoeff() - 1, high = x.maxCoeff();
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (low + high);
    ((x.array() - middle).cwiseMax(0).sum() > 1 ? low : high) = middle;
  }
  return (x.array() - high).cwiseMax(0);
}

/// Accelerated projected gradient: slow, and nothing in common with an active-set method.
Eigen::VectorXd projectedGradient(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, int steps) {
  const double length = 1 / b.operatorNorm();
  Eigen::VectorXd x = Eigen::VectorXd::Constant(g.size(), 1.0 / static_cast<double>(g.size())), y = x;
  double momentum = 1;
  for (int k = 0; k < steps; ++k) {
    const Eigen::VectorXd next = nearestOnSimplex(y - length * (b * y + g));
    if ((y - next).dot(next - x) > 0) {  // overshoot: restart
      momentum = 1;
      y = x;
      continue;
    }
    const double grown = 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum));
    y = next + (momentum - 1) / grown * (next - x);
    x = next;
    momentum = grown;
  }
  return x;
}

double value(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, const Eigen::VectorXd& x) {
  return 0.5 * x.dot(b * x) + g.dot(x);
}

/// How far a point is from optimal, by duality: f(x) - f* <= max over the simplex of slope . (x - y).
double dualityGap(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, const Eigen::VectorXd& x) {
  const Eigen::VectorXd slope = b * x + g;
  return slope.dot(x) - slope.minCoeff();
}

void checkFeasible(const Eigen::VectorXd& x) {
  CHECK(x.minCoeff() >= 0);
  CHECK(x.sum() == Approx(1).epsilon(1e-14));
}

Eigen::MatrixXd randomGram(int n, int rank) {
  const Eigen::MatrixXd factor = Eigen::MatrixXd::Random(n, rank);
  return factor * factor.transpose();
}

std::vector<Eigen::VectorXd> starts(int n) {
  Eigen::VectorXd corner = Eigen::VectorXd::Unit(n, n - 1), half = Eigen::VectorXd::Zero(n);
  half[0] = half[n / 2] = 0.5;
  if (n == 1) half[0] = 1;
  return {Eigen::VectorXd::Constant(n, 1.0 / n), corner, half};
}

}  // namespace

TEST_CASE("the simplex minimiser agrees with a slow projected gradient on random problems, from any start") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-2, 1);
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 1 + trial % 12;
    const Eigen::MatrixXd b = randomGram(n, n + 2) + 0.05 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd g = std::pow(10.0, exponent(random)) * Eigen::VectorXd::Random(n);
    const Eigen::VectorXd slow = projectedGradient(b, g, 3000);
    REQUIRE(dualityGap(b, g, slow) < 1e-10);
    for (const auto& start : starts(n)) {
      const Eigen::VectorXd x = minimiseOnSimplex(b, g, start);
      INFO("trial " << trial << ", n = " << n);
      checkFeasible(x);
      CHECK(dualityGap(b, g, x) < 1e-12 * (1 + g.norm()));
      CHECK((x - slow).norm() < 1e-4);
      CHECK(value(b, g, x) <= value(b, g, slow) + 1e-12);
    }
  }
}

TEST_CASE("nearly singular quadratics: weights that mean the same shape, as reflected pairs do") {
  for (int trial = 0; trial < 40; ++trial) {
    const int n = 2 + trial % 9;
    Eigen::MatrixXd factor(2 * n, std::max(1, n / 2));
    factor.topRows(n) = Eigen::MatrixXd::Random(n, factor.cols());
    factor.bottomRows(n) = -factor.topRows(n);
    const double proximal = 1e-7;
    const Eigen::MatrixXd b = factor * factor.transpose() + proximal * Eigen::MatrixXd::Identity(2 * n, 2 * n);
    const Eigen::VectorXd wanted = factor.transpose() * Eigen::VectorXd::Random(2 * n) * (trial % 3 == 0 ? 3.0 : 0.1);
    const Eigen::VectorXd g = -factor * wanted;
    for (const auto& start : starts(2 * n)) {
      const Eigen::VectorXd x = minimiseOnSimplex(b, g, start);
      INFO("trial " << trial);
      checkFeasible(x);
      CHECK(dualityGap(b, g, x) < 1e-9 * (1 + g.norm()));
    }
  }
}

TEST_CASE("degenerate problems: equal columns, ties, and minima in a corner, on an edge and inside") {
  const int n = 6;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  for (const auto& start : starts(n)) {
    const Eigen::VectorXd centre = minimiseOnSimplex(Eigen::MatrixXd::Identity(n, n), zero, start);
    CHECK((centre - Eigen::VectorXd::Constant(n, 1.0 / n)).norm() < 1e-14);

    Eigen::VectorXd g = zero;
    g[2] = -10;
    CHECK((minimiseOnSimplex(Eigen::MatrixXd::Identity(n, n), g, start) - Eigen::VectorXd::Unit(n, 2)).norm() < 1e-14);
    g[4] = -10;  // a tie: half each
    const Eigen::VectorXd tie = minimiseOnSimplex(Eigen::MatrixXd::Identity(n, n), g, start);
    CHECK(tie[2] == Approx(0.5));
    CHECK(tie[4] == Approx(0.5));

    // the unconstrained minimum lies exactly on a corner, where every multiplier vanishes
    const Eigen::VectorXd corner =
        minimiseOnSimplex(Eigen::MatrixXd::Identity(n, n), -Eigen::VectorXd::Unit(n, 3), start);
    CHECK((corner - Eigen::VectorXd::Unit(n, 3)).norm() < 1e-14);

    Eigen::MatrixXd same = Eigen::MatrixXd::Constant(n, n, 1.0);  // all columns equal but for the proximal term
    same.diagonal().array() += 1e-9;
    const Eigen::VectorXd x = minimiseOnSimplex(same, Eigen::VectorXd::Constant(n, -3), start);
    checkFeasible(x);
    CHECK(dualityGap(same, Eigen::VectorXd::Constant(n, -3), x) < 1e-9);
  }
}

TEST_CASE("the simplex minimiser does not care about units") {
  for (int trial = 0; trial < 10; ++trial) {
    const int n = 8;
    const Eigen::MatrixXd b = randomGram(n, n) + 0.1 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd g = Eigen::VectorXd::Random(n), start = Eigen::VectorXd::Constant(n, 1.0 / n);
    const Eigen::VectorXd expected = minimiseOnSimplex(b, g, start);
    for (const double scale : {1e-14, 1e12})
      CHECK((minimiseOnSimplex(scale * b, scale * g, start) - expected).norm() < 1e-9);
  }
}
