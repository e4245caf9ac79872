#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "core/numerics/block_pattern.h"

namespace shaped {

/// Vectors side by side, each a column; the entries of one row lie together.
using VectorBundle = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Symmetric matrix of 3 x 3 blocks; only blocks on and below the diagonal are stored, each column-major and
/// contiguous.
class SymmetricBlockMatrix {
 public:
  explicit SymmetricBlockMatrix(BlockPatternPtr pattern);

  const BlockPattern& pattern() const { return *pattern_; }
  void setZero() { std::fill(values_.begin(), values_.end(), 0.0); }
  double* block(std::int32_t lower_slot) { return values_.data() + 9 * static_cast<std::size_t>(lower_slot); }
  const double* block(std::int32_t lower_slot) const {
    return values_.data() + 9 * static_cast<std::size_t>(lower_slot);
  }

  /// y += A x; x and y have 3 n entries and do not overlap.
  void multiplyAdd(const double* x, double* y) const;
  /// A x, for many vectors several times as fast as one by one. x: 3n rows.
  VectorBundle operator*(const VectorBundle& x) const;
  /// The whole matrix with both triangles, 3n x 3n.
  Eigen::SparseMatrix<double> toSparse() const;

 private:
  BlockPatternPtr pattern_;
  std::vector<double> values_;
};

/// Matrix of 3 x 3 blocks without symmetry, all blocks of the pattern stored, each column-major and contiguous.
class GeneralBlockMatrix {
 public:
  explicit GeneralBlockMatrix(BlockPatternPtr pattern);

  const BlockPattern& pattern() const { return *pattern_; }
  void setZero() { std::fill(values_.begin(), values_.end(), 0.0); }
  double* block(std::int32_t slot) { return values_.data() + 9 * static_cast<std::size_t>(slot); }
  const double* block(std::int32_t slot) const { return values_.data() + 9 * static_cast<std::size_t>(slot); }

  /// y += scale A x.
  void multiplyAdd(double scale, const double* x, double* y) const;
  /// As for SymmetricBlockMatrix.
  VectorBundle operator*(const VectorBundle& x) const;
  /// y += scale A^T x.
  void multiplyTransposedAdd(double scale, const double* x, double* y) const;
  /// This += other^T; the pattern must be the same.
  void addTransposed(const GeneralBlockMatrix& other);
  Eigen::SparseMatrix<double> toSparse() const;

 private:
  BlockPatternPtr pattern_;
  std::vector<double> values_;
};

}  // namespace shaped
