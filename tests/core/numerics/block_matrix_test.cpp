#include "core/numerics/block_matrix.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>
#include <set>

#include "tests/support/random_blocks.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const std::vector<std::vector<std::int32_t>> kStencils{{4, 1, 2}, {0, 3}, {5, 2, 0, 3}, {1, 4}, {2, 5}};
constexpr std::int32_t kNodes = 7;  // the last one stands alone

std::set<std::pair<int, int>> coupledPairs() {
  std::set<std::pair<int, int>> pairs;
  for (int node = 0; node < kNodes; ++node) pairs.insert({node, node});
  for (const auto& stencil : kStencils)
    for (const int a : stencil)
      for (const int b : stencil) pairs.insert({a, b});
  return pairs;
}

}  // namespace

TEST_CASE("a block pattern holds exactly the coupled pairs and the diagonal, each in its slot") {
  const BlockPattern pattern(kNodes, kStencils);
  const auto pairs = coupledPairs();
  CHECK(pattern.nodeCount() == kNodes);
  CHECK(pattern.blockCount() == static_cast<int>(pairs.size()));
  std::set<std::pair<int, int>> stored;
  std::set<std::int32_t> slots, lower_slots;
  for (std::int32_t column = 0; column < kNodes; ++column) {
    const auto rows = pattern.rows(column);
    CHECK(std::is_sorted(rows.begin(), rows.end()));
    for (std::size_t k = 0; k < rows.size(); ++k) {
      stored.insert({rows[k], column});
      slots.insert(pattern.slot(rows[k], column));
      CHECK(pattern.slot(rows[k], column) == pattern.begin(column) + static_cast<int>(k));
    }
    const auto lower = pattern.lowerRows(column);
    REQUIRE(!lower.empty());
    CHECK(lower.front() == column);
    for (std::size_t k = 0; k < lower.size(); ++k) {
      CHECK(lower[k] >= column);
      CHECK(pattern.lowerSlot(lower[k], column) == pattern.lowerBegin(column) + static_cast<int>(k));
      lower_slots.insert(pattern.lowerSlot(lower[k], column));
    }
  }
  CHECK(stored == pairs);
  CHECK(slots.size() == pairs.size());
  CHECK(*slots.rbegin() + 1 == pattern.blockCount());
  CHECK(lower_slots.size() == (pairs.size() + kNodes) / 2);
  CHECK(*lower_slots.rbegin() + 1 == pattern.lowerBlockCount());
}

TEST_CASE("block matrices multiply and expand like the dense matrix with the same blocks") {
  const auto pattern = std::make_shared<const BlockPattern>(kNodes, kStencils);
  std::mt19937 random(5);
  const Eigen::VectorXd x = Eigen::VectorXd::Random(3 * kNodes), start = Eigen::VectorXd::Random(3 * kNodes);

  const Eigen::MatrixXd symmetric = randomSymmetric(*pattern, random);
  const SymmetricBlockMatrix blocks = symmetricBlocks(pattern, symmetric);
  CHECK((Eigen::MatrixXd(blocks.toSparse()) - symmetric).norm() == 0);
  Eigen::VectorXd y = start;
  blocks.multiplyAdd(x.data(), y.data());
  CHECK((y - start - symmetric * x).norm() < 1e-13);
  const VectorBundle bundle = Eigen::MatrixXd::Random(3 * kNodes, 5);
  CHECK((blocks * bundle - symmetric * bundle).norm() < 1e-12);

  const Eigen::MatrixXd general = randomGeneral(*pattern, random);
  REQUIRE((general - general.transpose()).norm() > 1);
  const GeneralBlockMatrix all = generalBlocks(pattern, general);
  CHECK((Eigen::MatrixXd(all.toSparse()) - general).norm() == 0);
  y = start;
  all.multiplyAdd(-1.5, x.data(), y.data());
  CHECK((y - start + 1.5 * general * x).norm() < 1e-13);
  CHECK((all * bundle - general * bundle).norm() < 1e-12);
  y = start;
  all.multiplyTransposedAdd(0.5, x.data(), y.data());
  CHECK((y - start - 0.5 * general.transpose() * x).norm() < 1e-13);
}

TEST_CASE("a block matrix set to zero forgets its values and keeps its pattern") {
  const auto pattern = std::make_shared<const BlockPattern>(kNodes, kStencils);
  std::mt19937 random(6);
  auto blocks = symmetricBlocks(pattern, randomSymmetric(*pattern, random));
  auto all = generalBlocks(pattern, randomGeneral(*pattern, random));
  blocks.setZero();
  all.setZero();
  CHECK(blocks.toSparse().norm() == 0);
  CHECK(all.toSparse().norm() == 0);
  CHECK(all.toSparse().nonZeros() == 9 * pattern->blockCount());
}

TEST_CASE("a block matrix takes up another one transposed") {
  const auto pattern = std::make_shared<const BlockPattern>(kNodes, kStencils);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto filled = [&] {
    GeneralBlockMatrix matrix(pattern);
    for (std::int32_t slot = 0; slot < pattern->blockCount(); ++slot)
      for (int i = 0; i < 9; ++i) matrix.block(slot)[i] = normal(random);
    return matrix;
  };
  auto sum = filled();
  const auto other = filled();
  const Eigen::MatrixXd expected = Eigen::MatrixXd(sum.toSparse()) + Eigen::MatrixXd(other.toSparse()).transpose();
  sum.addTransposed(other);
  CHECK((Eigen::MatrixXd(sum.toSparse()) - expected).norm() < 1e-14);
}
