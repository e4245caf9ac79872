#include "core/curve/block_tridiagonal.h"

namespace shaped {

bool BlockTridiagonalCholesky::factorise(const std::vector<Eigen::MatrixXd>& diagonal,
                                         const std::vector<Eigen::MatrixXd>& above, double shift) {
  pivots_.clear();
  above_ = above;
  for (std::size_t i = 0; i < diagonal.size(); ++i) {
    Eigen::MatrixXd pivot = diagonal[i];
    pivot.diagonal().array() += shift;
    if (i > 0) pivot.noalias() -= above[i - 1].transpose() * pivots_.back().solve(above[i - 1]);
    pivots_.emplace_back(pivot);
    if (pivots_.back().info() == Eigen::Success) continue;
    pivots_.clear();
    return false;
  }
  return true;
}

Eigen::VectorXd BlockTridiagonalCholesky::solve(const Eigen::VectorXd& right) const {
  Eigen::VectorXd result = right;
  const auto part = [&](std::size_t i) { return result.segment(static_cast<Eigen::Index>(i) * size(), size()); };
  for (std::size_t i = 0; i < blocks(); ++i) {
    if (i > 0) part(i).noalias() -= above_[i - 1].transpose() * part(i - 1);
    pivots_[i].solveInPlace(part(i));
  }
  for (std::size_t i = blocks(); i-- > 1;) part(i - 1) -= pivots_[i - 1].solve(above_[i - 1] * part(i));
  return result;
}

}  // namespace shaped
