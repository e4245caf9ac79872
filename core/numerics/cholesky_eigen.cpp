// Eigen's simplicial factorisation behind core/numerics/cholesky.h, for builds without CHOLMOD's supernodal module.
#ifndef SHAPED_SUPERNODAL

#include <Eigen/SparseCholesky>

#include "core/numerics/cholesky.h"
#include "core/numerics/long_piece.h"

namespace shaped {

struct CholeskyAnalysis::Impl {};

std::shared_ptr<const CholeskyAnalysis::Impl> CholeskyAnalysis::analyse(const BlockPattern&,
                                                                        const std::stop_token& stop) {
  return stop.stop_requested() ? nullptr : std::make_shared<const Impl>();
}

struct CholeskyFactor::Impl {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
  Pins held;
  bool analysed = false;
};

CholeskyFactor::CholeskyFactor(CholeskyAnalysisPtr) : impl_(std::make_unique<Impl>()) {}
CholeskyFactor::~CholeskyFactor() = default;
CholeskyFactor::CholeskyFactor(CholeskyFactor&&) noexcept = default;
CholeskyFactor& CholeskyFactor::operator=(CholeskyFactor&&) noexcept = default;

bool CholeskyFactor::factorise(const SymmetricBlockMatrix& matrix, const Pins& pins, const std::stop_token& stop) {
  if (stop.stop_requested()) return false;
  const LongPiece piece("factorisation");
  Eigen::SparseMatrix<double> sparse = matrix.toSparse();
  for (int column = 0; column < sparse.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator it(sparse, column); it; ++it)
      if (pins.pinned(static_cast<std::size_t>(it.row())) || pins.pinned(static_cast<std::size_t>(it.col())))
        it.valueRef() = it.row() == it.col() ? 1.0 : 0.0;
  if (!sparse.coeffs().allFinite()) return false;
  if (!impl_->analysed) impl_->solver.analyzePattern(sparse);
  impl_->analysed = true;
  impl_->held = pins;
  impl_->solver.factorize(sparse);
  return impl_->solver.info() == Eigen::Success && !stop.stop_requested();
}

void CholeskyFactor::solve(const double* b, double* x, int columns, const std::stop_token&) const {
  const LongPiece piece("solve");
  const auto n = impl_->solver.rows();
  const Eigen::MatrixXd solution = impl_->solver.solve(Eigen::Map<const Eigen::MatrixXd>(b, n, columns));
  Eigen::Map<Eigen::MatrixXd>(x, n, columns) = solution;
  for (int column = 0; column < columns; ++column) impl_->held.clear(x + n * column);
}

}  // namespace shaped

#endif
