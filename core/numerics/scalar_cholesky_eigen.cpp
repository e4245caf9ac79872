// Eigen's simplicial factorisation behind core/numerics/scalar_cholesky.h, for builds without CHOLMOD's supernodal
// module.
#ifndef SHAPED_SUPERNODAL

#include <Eigen/SparseCholesky>

#include "core/numerics/long_piece.h"
#include "core/numerics/scalar_cholesky.h"

namespace shaped {

struct ScalarCholesky::Impl {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
};

ScalarCholesky::ScalarCholesky() : impl_(std::make_unique<Impl>()) {}
ScalarCholesky::~ScalarCholesky() = default;
ScalarCholesky::ScalarCholesky(ScalarCholesky&&) noexcept = default;
ScalarCholesky& ScalarCholesky::operator=(ScalarCholesky&&) noexcept = default;

bool ScalarCholesky::compute(const Eigen::SparseMatrix<double>& matrix, const std::stop_token& stop) {
  if (stop.stop_requested() || !matrix.coeffs().allFinite()) return false;
  impl_->solver.analyzePattern(matrix);
  if (stop.stop_requested()) return false;
  const LongPiece piece("factorisation");
  impl_->solver.factorize(matrix);
  return impl_->solver.info() == Eigen::Success && !stop.stop_requested();
}

Eigen::MatrixXd ScalarCholesky::solve(const Eigen::MatrixXd& b) const {
  const LongPiece piece("solve");
  return impl_->solver.solve(b);
}

std::size_t ScalarCholesky::bytes() const {
  const auto& lower = impl_->solver.matrixL().nestedExpression();
  return static_cast<std::size_t>(lower.nonZeros()) * (sizeof(double) + sizeof(int));
}

}  // namespace shaped

#endif
