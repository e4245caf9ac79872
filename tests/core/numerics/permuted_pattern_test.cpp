#include "core/numerics/permuted_pattern.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>

#include "tests/support/random_blocks.h"

using namespace shaped;
using namespace shaped::test;

namespace {

std::vector<std::int32_t> shuffled(std::int32_t nodes, std::mt19937& random) {
  std::vector<std::int32_t> order(static_cast<std::size_t>(nodes));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  return order;
}

/// The lower triangle that the compressed columns describe.
Eigen::MatrixXd lowerTriangle(const PermutedPattern& pattern, const std::vector<double>& values) {
  const auto n = static_cast<Eigen::Index>(pattern.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index column = 0; column < n; ++column)
    for (int k = pattern.begin()[static_cast<std::size_t>(column)];
         k < pattern.begin()[static_cast<std::size_t>(column) + 1]; ++k)
      if (pattern.rows()[static_cast<std::size_t>(k)] >= column)
        result(pattern.rows()[static_cast<std::size_t>(k)], column) = values[static_cast<std::size_t>(k)];
  return result;
}

}  // namespace

TEST_CASE(
    "a permuted pattern holds the lower triangle of P A P^T, with unit rows and columns where unknowns are pinned") {
  const std::int32_t nodes = 14;
  const auto pattern = ringPattern(nodes);
  std::mt19937 random(1);
  Eigen::MatrixXd dense = randomSymmetric(*pattern, random);
  const PermutedPattern permuted(*pattern, shuffled(nodes, random));
  const auto matrix = symmetricBlocks(pattern, dense);
  Pins pins(nodes);
  for (const bool pinned : {false, true}) {
    if (pinned) {
      pins.pinAll(3);
      pins.pin(8, 1);
      for (const int i : {9, 10, 11, 25}) {
        dense.row(i).setZero();
        dense.col(i).setZero();
        dense(i, i) = 1;
      }
    }
    std::vector<double> values(permuted.rows().size());
    permuted.copyValues(matrix, pins, values.data());
    Eigen::MatrixXd expected(3 * nodes, 3 * nodes);
    for (Eigen::Index column = 0; column < expected.cols(); ++column)
      permuted.permute(dense.col(column).data(), expected.col(column).data());
    Eigen::MatrixXd both(3 * nodes, 3 * nodes);
    for (Eigen::Index row = 0; row < expected.rows(); ++row) {
      const Eigen::VectorXd from = expected.row(row);
      Eigen::VectorXd to(from.size());
      permuted.permute(from.data(), to.data());
      both.row(row) = to;
    }
    CHECK(lowerTriangle(permuted, values) == Eigen::MatrixXd(both.triangularView<Eigen::Lower>()));
  }
}

TEST_CASE("permuting back undoes the permutation") {
  std::mt19937 random(2);
  const PermutedPattern permuted(*ringPattern(9), shuffled(9, random));
  const Eigen::VectorXd x = Eigen::VectorXd::Random(27);
  Eigen::VectorXd there(27), back(27);
  permuted.permute(x.data(), there.data());
  permuted.permuteBack(there.data(), back.data());
  CHECK(back == x);
  CHECK(there != x);
}
