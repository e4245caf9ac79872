// CHOLMOD's supernodal factorisation behind core/numerics/scalar_cholesky.h.
#ifdef SHAPED_SUPERNODAL

#include <stdexcept>

#include "core/numerics/cholmod_support.h"
#include "core/numerics/interruptible_blas.h"
#include "core/numerics/long_piece.h"
#include "core/numerics/scalar_cholesky.h"

namespace shaped {

struct ScalarCholesky::Impl {
  CholmodFactorPtr factor;
};

ScalarCholesky::ScalarCholesky() : impl_(std::make_unique<Impl>()) {}
ScalarCholesky::~ScalarCholesky() = default;
ScalarCholesky::ScalarCholesky(ScalarCholesky&&) noexcept = default;
ScalarCholesky& ScalarCholesky::operator=(ScalarCholesky&&) noexcept = default;

bool ScalarCholesky::compute(const Eigen::SparseMatrix<double>& matrix, const std::stop_token& stop) {
  if (stop.stop_requested() || !matrix.coeffs().allFinite()) return false;
  const Eigen::SparseMatrix<double> lower = matrix.triangularView<Eigen::Lower>();
  auto view = cholmodLower(static_cast<std::size_t>(lower.cols()), lower.outerIndexPtr(), lower.innerIndexPtr(),
                           lower.valuePtr());
  impl_->factor = analyseByDegree(view, CHOLMOD_SUPERNODAL);
  if (stop.stop_requested()) return false;
  const LongPiece piece("factorisation");
  auto* common = cholmodOfThisThread();
  const InterruptibleBlas blas(stop);
  return cholmod_factorize(&view, impl_->factor.get(), common) && common->status == CHOLMOD_OK &&
         impl_->factor->minor == impl_->factor->n && !stop.stop_requested();
}

Eigen::MatrixXd ScalarCholesky::solve(const Eigen::MatrixXd& b) const {
  const LongPiece piece("solve");
  auto* common = cholmodOfThisThread();
  auto right = cholmodDense(static_cast<std::size_t>(b.rows()), static_cast<std::size_t>(b.cols()),
                            const_cast<double*>(b.data()));
  auto* solved = cholmod_solve(CHOLMOD_A, impl_->factor.get(), &right, common);
  if (!solved) throw std::runtime_error("CHOLMOD could not solve with a factor");
  Eigen::MatrixXd x = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(solved->x), b.rows(), b.cols());
  cholmod_free_dense(&solved, common);
  return x;
}

std::size_t ScalarCholesky::bytes() const {
  if (!impl_->factor) return 0;
  const auto& factor = *impl_->factor;
  return factor.xsize * sizeof(double) + (factor.ssize + 2 * factor.n + 3 * factor.nsuper) * sizeof(int);
}

}  // namespace shaped

#endif
