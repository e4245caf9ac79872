#include "tests/support/random_blocks.h"

namespace shaped::test {
namespace {

void copyBlock(const Eigen::MatrixXd& dense, std::int32_t row, std::int32_t column, double* block) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) block[3 * c + r] = dense(3 * row + r, 3 * column + c);
}

}  // namespace

Eigen::MatrixXd randomGeneral(const BlockPattern& pattern, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * pattern.nodeCount(), 3 * pattern.nodeCount());
  for (std::int32_t column = 0; column < pattern.nodeCount(); ++column)
    for (const auto row : pattern.rows(column))
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) dense(3 * row + r, 3 * column + c) = uniform(random);
  return dense;
}

Eigen::MatrixXd randomSymmetric(const BlockPattern& pattern, std::mt19937& random) {
  const Eigen::MatrixXd general = randomGeneral(pattern, random);
  return 0.5 * (general + general.transpose());
}

Eigen::MatrixXd randomPositive(const BlockPattern& pattern, std::mt19937& random) {
  Eigen::MatrixXd dense = randomSymmetric(pattern, random);
  dense.diagonal().array() += dense.cwiseAbs().rowwise().sum().maxCoeff();
  return dense;
}

SymmetricBlockMatrix symmetricBlocks(const BlockPatternPtr& pattern, const Eigen::MatrixXd& dense) {
  SymmetricBlockMatrix matrix(pattern);
  for (std::int32_t column = 0; column < pattern->nodeCount(); ++column)
    for (const auto row : pattern->lowerRows(column))
      copyBlock(dense, row, column, matrix.block(pattern->lowerSlot(row, column)));
  return matrix;
}

GeneralBlockMatrix generalBlocks(const BlockPatternPtr& pattern, const Eigen::MatrixXd& dense) {
  GeneralBlockMatrix matrix(pattern);
  for (std::int32_t column = 0; column < pattern->nodeCount(); ++column)
    for (const auto row : pattern->rows(column))
      copyBlock(dense, row, column, matrix.block(pattern->slot(row, column)));
  return matrix;
}

BlockPatternPtr ringPattern(std::int32_t nodes) {
  std::vector<std::vector<std::int32_t>> stencils;
  for (std::int32_t n = 0; n < nodes; ++n) stencils.push_back({n, (n + 1) % nodes, (n + nodes / 2) % nodes});
  return std::make_shared<const BlockPattern>(nodes, stencils);
}

}  // namespace shaped::test
