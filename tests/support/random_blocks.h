#pragma once

#include <Eigen/Core>
#include <random>

#include "core/numerics/block_matrix.h"

namespace shaped::test {

/// A dense symmetric matrix, 3n x 3n, with entries in [-1, 1] in the pattern's blocks and zero elsewhere.
Eigen::MatrixXd randomSymmetric(const BlockPattern& pattern, std::mt19937& random);

/// The same without symmetry of the values.
Eigen::MatrixXd randomGeneral(const BlockPattern& pattern, std::mt19937& random);

/// randomSymmetric made positive definite by a dominant diagonal.
Eigen::MatrixXd randomPositive(const BlockPattern& pattern, std::mt19937& random);

/// The pattern's blocks of a dense matrix, copied entry by entry.
SymmetricBlockMatrix symmetricBlocks(const BlockPatternPtr& pattern, const Eigen::MatrixXd& dense);
GeneralBlockMatrix generalBlocks(const BlockPatternPtr& pattern, const Eigen::MatrixXd& dense);

/// Nodes in a ring, each coupled with its two neighbours and with the one across.
BlockPatternPtr ringPattern(std::int32_t nodes);

}  // namespace shaped::test
