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

std::vector<Eigen::VectorXd> BlockTridiagonalCholesky::solve(std::vector<Eigen::VectorXd> right) const {
  for (std::size_t i = 0; i < right.size(); ++i) {
    if (i > 0) right[i].noalias() -= above_[i - 1].transpose() * right[i - 1];
    right[i] = pivots_[i].solve(right[i]);
  }
  for (std::size_t i = right.size(); i-- > 1;) right[i - 1] -= pivots_[i - 1].solve(above_[i - 1] * right[i]);
  return right;
}

}  // namespace shaped
