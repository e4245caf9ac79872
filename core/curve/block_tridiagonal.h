#pragma once

#include <Eigen/Cholesky>
#include <vector>

namespace shaped {

/// Factors a symmetric positive definite matrix of dense d x d blocks on three diagonals: S_1 = D_1,
/// S_i = D_i - O_i-1^T S_i-1^-1 O_i-1, each by Cholesky's method. What it takes grows with the number of blocks.
class BlockTridiagonalCholesky {
 public:
  /// diagonal: n blocks. above: n - 1 blocks, the i-th couples rows of block i to columns of block i + 1. shift: added
  /// to the diagonal, >= 0. False where the sum is not positive definite; then there is nothing to solve with.
  bool factorise(const std::vector<Eigen::MatrixXd>& diagonal, const std::vector<Eigen::MatrixXd>& above, double shift);

  /// right: n times d entries, block by block.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  std::size_t blocks() const { return pivots_.size(); }                               ///< 0: nothing to solve with
  Eigen::Index size() const { return pivots_.empty() ? 0 : pivots_.front().rows(); }  ///< of a block

 private:
  std::vector<Eigen::LLT<Eigen::MatrixXd>> pivots_;
  std::vector<Eigen::MatrixXd> above_;
};

}  // namespace shaped
