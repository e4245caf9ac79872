#include "core/numerics/block_matrix.h"

namespace shaped {
namespace {

/// y += B x for one column-major block.
inline void addProduct(const double* b, const double* x, double* y) {
  y[0] += b[0] * x[0] + b[3] * x[1] + b[6] * x[2];
  y[1] += b[1] * x[0] + b[4] * x[1] + b[7] * x[2];
  y[2] += b[2] * x[0] + b[5] * x[1] + b[8] * x[2];
}

/// y += B^T x for one column-major block.
inline void addTransposedProduct(const double* b, const double* x, double* y) {
  y[0] += b[0] * x[0] + b[1] * x[1] + b[2] * x[2];
  y[1] += b[3] * x[0] + b[4] * x[1] + b[5] * x[2];
  y[2] += b[6] * x[0] + b[7] * x[1] + b[8] * x[2];
}

/// Three rows of y += B times three rows of x.
inline void addProduct(const double* b, const VectorBundle& x, std::int32_t from, VectorBundle& y, std::int32_t to) {
  for (int r = 0; r < 3; ++r)
    y.row(3 * to + r) += b[r] * x.row(3 * from) + b[3 + r] * x.row(3 * from + 1) + b[6 + r] * x.row(3 * from + 2);
}
inline void addTransposedProduct(const double* b, const VectorBundle& x, std::int32_t from, VectorBundle& y,
                                 std::int32_t to) {
  for (int r = 0; r < 3; ++r)
    y.row(3 * to + r) +=
        b[3 * r] * x.row(3 * from) + b[3 * r + 1] * x.row(3 * from + 1) + b[3 * r + 2] * x.row(3 * from + 2);
}

using Triplets = std::vector<Eigen::Triplet<double>>;

void appendBlock(const double* block, int row, int column, bool transposed, Triplets& triplets) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      const double value = block[3 * c + r];
      triplets.emplace_back(3 * row + (transposed ? c : r), 3 * column + (transposed ? r : c), value);
    }
}

Eigen::SparseMatrix<double> assemble(std::int32_t node_count, const Triplets& triplets) {
  Eigen::SparseMatrix<double> matrix(3 * node_count, 3 * node_count);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

}  // namespace

SymmetricBlockMatrix::SymmetricBlockMatrix(BlockPatternPtr pattern)
    : pattern_(std::move(pattern)), values_(9 * static_cast<std::size_t>(pattern_->lowerBlockCount()), 0.0) {}

void SymmetricBlockMatrix::multiplyAdd(const double* x, double* y) const {
  const double* b = values_.data();
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column) {
    const auto rows = pattern_->lowerRows(column);
    const double* xc = x + 3 * static_cast<std::size_t>(column);
    double sum[3] = {0, 0, 0};
    addProduct(b, xc, sum);
    b += 9;
    for (const auto row : rows.subspan(1)) {
      addProduct(b, xc, y + 3 * static_cast<std::size_t>(row));
      addTransposedProduct(b, x + 3 * static_cast<std::size_t>(row), sum);
      b += 9;
    }
    for (int k = 0; k < 3; ++k) y[3 * static_cast<std::size_t>(column) + k] += sum[k];
  }
}

VectorBundle SymmetricBlockMatrix::operator*(const VectorBundle& x) const {
  VectorBundle y = VectorBundle::Zero(x.rows(), x.cols());
  const double* b = values_.data();
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    for (const auto row : pattern_->lowerRows(column)) {
      addProduct(b, x, column, y, row);
      if (row != column) addTransposedProduct(b, x, row, y, column);
      b += 9;
    }
  return y;
}

Eigen::SparseMatrix<double> SymmetricBlockMatrix::toSparse() const {
  Triplets triplets;
  std::int32_t slot = 0;
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    for (const auto row : pattern_->lowerRows(column)) {
      appendBlock(block(slot), row, column, false, triplets);
      if (row != column) appendBlock(block(slot), column, row, true, triplets);
      ++slot;
    }
  return assemble(pattern_->nodeCount(), triplets);
}

GeneralBlockMatrix::GeneralBlockMatrix(BlockPatternPtr pattern)
    : pattern_(std::move(pattern)), values_(9 * static_cast<std::size_t>(pattern_->blockCount()), 0.0) {}

void GeneralBlockMatrix::multiplyAdd(double scale, const double* x, double* y) const {
  const double* b = values_.data();
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column) {
    const double* xc = x + 3 * static_cast<std::size_t>(column);
    const double scaled[3] = {scale * xc[0], scale * xc[1], scale * xc[2]};
    for (const auto row : pattern_->rows(column)) {
      addProduct(b, scaled, y + 3 * static_cast<std::size_t>(row));
      b += 9;
    }
  }
}

VectorBundle GeneralBlockMatrix::operator*(const VectorBundle& x) const {
  VectorBundle y = VectorBundle::Zero(x.rows(), x.cols());
  const double* b = values_.data();
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    for (const auto row : pattern_->rows(column)) {
      addProduct(b, x, column, y, row);
      b += 9;
    }
  return y;
}

void GeneralBlockMatrix::multiplyTransposedAdd(double scale, const double* x, double* y) const {
  const double* b = values_.data();
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column) {
    double sum[3] = {0, 0, 0};
    for (const auto row : pattern_->rows(column)) {
      addTransposedProduct(b, x + 3 * static_cast<std::size_t>(row), sum);
      b += 9;
    }
    for (int k = 0; k < 3; ++k) y[3 * static_cast<std::size_t>(column) + k] += scale * sum[k];
  }
}

void GeneralBlockMatrix::addTransposed(const GeneralBlockMatrix& other) {
  // A column is read along the rows of the other matrix. Rows are visited in order, so a cursor per column finds each
  // block without a search.
  std::vector<std::int32_t> cursor(static_cast<std::size_t>(pattern_->nodeCount()));
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    cursor[static_cast<std::size_t>(column)] = pattern_->begin(column);
  std::int32_t slot = 0;
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    for (const auto row : pattern_->rows(column)) {
      const double* source = other.block(slot++);
      double* target = block(cursor[static_cast<std::size_t>(row)]++);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) target[3 * r + c] += source[3 * c + r];
    }
}

Eigen::SparseMatrix<double> GeneralBlockMatrix::toSparse() const {
  Triplets triplets;
  std::int32_t slot = 0;
  for (std::int32_t column = 0; column < pattern_->nodeCount(); ++column)
    for (const auto row : pattern_->rows(column)) appendBlock(block(slot++), row, column, false, triplets);
  return assemble(pattern_->nodeCount(), triplets);
}

}  // namespace shaped
