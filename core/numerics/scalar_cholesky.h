#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <stop_token>

namespace shaped {

/// L L^T of a symmetric positive definite matrix of single numbers, such as a mesh's Laplacian. For matrices whose
/// unknowns come in threes and share a pattern, see CholeskyFactor.
class ScalarCholesky {
 public:
  ScalarCholesky();
  ~ScalarCholesky();
  ScalarCholesky(ScalarCholesky&&) noexcept;
  ScalarCholesky& operator=(ScalarCholesky&&) noexcept;

  /// Orders, analyses and factorises; only the lower triangle is read, and it must be compressed. False when the matrix
  /// is not positive definite (or not finite), or when the stop token has fired, and then solve() must not be called.
  /// Looks at the token before each dense kernel, but not while it orders: 45 ms for 39,000 unknowns.
  bool compute(const Eigen::SparseMatrix<double>& matrix, const std::stop_token& stop = {});

  /// A^-1 b for each column. May be called from several threads at once.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

  /// Memory of the factor [bytes].
  std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaped
