#include "core/numerics/gmres.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

using namespace shaped;

namespace {

LinearMap applying(const Eigen::MatrixXd& matrix) {
  return [matrix](const Eigen::VectorXd& x, Eigen::VectorXd& y) { y = matrix * x; };
}

LinearMap identity(int n) { return applying(Eigen::MatrixXd::Identity(n, n)); }

/// Far from symmetric, with eigenvalues around 2.
Eigen::MatrixXd nonSymmetric(int n) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(n, n) / std::sqrt(n);
  matrix.diagonal().array() += 2;
  matrix.diagonal(1).array() += 1;
  return matrix;
}

double relativeError(const Eigen::VectorXd& x, const Eigen::VectorXd& expected) {
  return (x - expected).norm() / expected.norm();
}

}  // namespace

TEST_CASE("GMRES solves non-symmetric systems like a dense factorisation") {
  for (const int n : {1, 2, 10, 60}) {
    const Eigen::MatrixXd matrix = nonSymmetric(std::max(n, 2)).topLeftCorner(n, n);
    const Eigen::VectorXd b = Eigen::VectorXd::Random(n), expected = matrix.partialPivLu().solve(b);
    Eigen::VectorXd x;
    const double reached = gmres(applying(matrix), identity(n), b, 1e-13, n + 5, x);
    INFO("n = " << n);
    CHECK(reached <= 1e-12);
    CHECK(relativeError(x, expected) < 1e-11);
  }
}

TEST_CASE("GMRES reports the preconditioned residual that it reached") {
  const int n = 40;
  const Eigen::MatrixXd matrix = nonSymmetric(n);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
  const Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(n, 0.5, 2);
  const LinearMap precondition = applying(weights.asDiagonal());
  for (const int limit : {1, 3, 8, 60}) {
    Eigen::VectorXd x;
    const double reached = gmres(applying(matrix), precondition, b, 1e-6, limit, x);
    const double actual = weights.cwiseProduct(b - matrix * x).norm() / weights.cwiseProduct(b).norm();
    INFO("limit " << limit);
    CHECK(reached == Approx(actual).epsilon(1e-8));
    CHECK((limit < 60 || reached <= 1e-6));
    CHECK((limit > 3 || reached > 1e-6));
  }
}

TEST_CASE("a good preconditioner saves steps and does not change the solution") {
  const int n = 50;
  Eigen::MatrixXd matrix = nonSymmetric(n);
  matrix = Eigen::VectorXd::LinSpaced(n, 1, 1e5).asDiagonal() * matrix;
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n), expected = matrix.partialPivLu().solve(b);
  Eigen::VectorXd plain, helped;
  const double without = gmres(applying(matrix), identity(n), b, 1e-10, 12, plain);
  const double with = gmres(applying(matrix), applying(matrix.inverse()), b, 1e-10, 12, helped);
  CHECK(without > 1e-4);
  CHECK(with <= 1e-10);
  CHECK(relativeError(helped, expected) < 1e-9);
}

TEST_CASE("GMRES does not care about the size of the right-hand side or of the matrix") {
  const int n = 30;
  const Eigen::MatrixXd matrix = nonSymmetric(n);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n), expected = matrix.partialPivLu().solve(b);
  for (const double rhs : {1e-30, 1.0, 1e25})
    for (const double size : {1e-20, 1.0, 1e20}) {
      Eigen::VectorXd x;
      const double reached = gmres(applying(size * matrix), identity(n), rhs * b, 1e-12, n + 5, x);
      INFO("b times " << rhs << ", A times " << size);
      CHECK(reached <= 1e-11);
      CHECK(relativeError(x, rhs / size * expected) < 1e-10);
    }
}

TEST_CASE("GMRES stops by itself where the Krylov space is exhausted, and on a zero right-hand side") {
  const int n = 20;
  Eigen::VectorXd eigenvalues = Eigen::VectorXd::Constant(n, 3);
  eigenvalues.tail(n / 2).setConstant(-1);  // minimal polynomial of degree two
  int applications = 0;
  const LinearMap counted = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
    ++applications;
    y = eigenvalues.cwiseProduct(x);
  };
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
  Eigen::VectorXd x;
  CHECK(gmres(counted, identity(n), b, 1e-20, 15, x) < 1e-14);
  CHECK(applications <= 3);
  CHECK(relativeError(x, b.cwiseQuotient(eigenvalues)) < 1e-13);
  CHECK(gmres(counted, identity(n), Eigen::VectorXd::Zero(n), 1e-10, 15, x) == 0);
  CHECK(x == Eigen::VectorXd::Zero(n));
}

TEST_CASE("GMRES ends when it is told to, with what it has") {
  const int n = 40;
  const Eigen::MatrixXd matrix = nonSymmetric(n);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
  std::stop_source stop;
  int images = 0;
  const LinearMap stopping = [&](const Eigen::VectorXd& x, Eigen::VectorXd& y) {
    if (++images == 5) stop.request_stop();
    y = matrix * x;
  };
  Eigen::VectorXd x, five;
  const double reached = gmres(stopping, identity(n), b, 1e-12, 60, x, stop.get_token());
  CHECK(images == 5);
  CHECK(reached == Approx(gmres(applying(matrix), identity(n), b, 1e-12, 5, five)));
  CHECK(relativeError(x, five) < 1e-12);
}
