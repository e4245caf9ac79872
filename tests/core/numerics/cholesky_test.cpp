#include "core/numerics/cholesky.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <limits>
#include <thread>

#include "core/numerics/long_piece.h"
#include "tests/support/random_blocks.h"

using namespace shaped;
using namespace shaped::test;

namespace {

Pins somePins(std::int32_t nodes) {
  Pins pins(nodes);
  pins.pinAll(2);
  pins.pin(5, 0);
  pins.pin(5, 2);
  pins.pin(nodes - 1, 1);
  return pins;
}

std::vector<int> freeUnknowns(const Pins& pins) {
  std::vector<int> free;
  for (std::size_t i = 0; i < pins.size(); ++i)
    if (!pins.pinned(i)) free.push_back(static_cast<int>(i));
  return free;
}

/// Dense solution on the free unknowns, zero in the pinned ones.
Eigen::MatrixXd denseSolve(const Eigen::MatrixXd& matrix, const Pins& pins, const Eigen::MatrixXd& b) {
  const auto free = freeUnknowns(pins);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
  const Eigen::MatrixXd inner = matrix(free, free), rhs = b(free, Eigen::all);
  const Eigen::MatrixXd solution = inner.llt().solve(rhs);
  x(free, Eigen::all) = solution;
  return x;
}

Eigen::VectorXd solveWith(const CholeskyFactor& factor, const Eigen::VectorXd& b) {
  Eigen::VectorXd x(b.size());
  factor.solve(b.data(), x.data());
  return x;
}

/// b with zeros where the pins want zeros: what every solver of ours hands over.
Eigen::MatrixXd cleared(Eigen::MatrixXd b, const Pins& pins) {
  for (Eigen::Index c = 0; c < b.cols(); ++c) pins.clear(b.col(c).data());
  return b;
}

}  // namespace

TEST_CASE("the sparse factor solves like a dense one on the free unknowns, for one and several right-hand sides") {
  const std::int32_t nodes = 40;
  const auto pattern = ringPattern(nodes);
  const auto analysis = std::make_shared<const CholeskyAnalysis>(pattern);
  std::mt19937 random(1);
  for (const Pins& pins : {Pins(nodes), somePins(nodes)}) {
    const Eigen::MatrixXd dense = randomPositive(*pattern, random);
    CholeskyFactor factor(analysis);
    REQUIRE(factor.factorise(symmetricBlocks(pattern, dense), pins));
    const Eigen::MatrixXd b = cleared(Eigen::MatrixXd::Random(3 * nodes, 4), pins);
    const Eigen::MatrixXd expected = denseSolve(dense, pins, b);
    Eigen::MatrixXd x(b.rows(), b.cols());
    factor.solve(b.data(), x.data(), 4);
    CHECK((x - expected).norm() < 1e-13 * expected.norm());
    Eigen::MatrixXd in_place = b;
    factor.solve(in_place.data(), in_place.data(), 4);
    CHECK((in_place - x).norm() == 0);
    CHECK((solveWith(factor, b.col(2)) - expected.col(2)).norm() < 1e-13 * expected.norm());
  }
}

TEST_CASE("pins keep their unknowns at zero whatever stands in their rows") {
  const std::int32_t nodes = 12;
  const auto pattern = ringPattern(nodes);
  std::mt19937 random(2);
  Eigen::MatrixXd dense = randomPositive(*pattern, random);
  const Pins pins = somePins(nodes);
  const Eigen::VectorXd b = cleared(Eigen::VectorXd::Random(3 * nodes), pins);
  const Eigen::VectorXd expected = denseSolve(dense, pins, b);
  for (std::size_t i = 0; i < pins.size(); ++i)
    if (pins.pinned(i)) dense(static_cast<int>(i), static_cast<int>(i)) = -7;  // would make the full matrix indefinite
  CholeskyFactor factor(std::make_shared<const CholeskyAnalysis>(pattern));
  REQUIRE(factor.factorise(symmetricBlocks(pattern, dense), pins));
  CHECK((solveWith(factor, b) - expected).norm() < 1e-13 * expected.norm());
  Eigen::VectorXd dirty = b;
  for (std::size_t i = 0; i < pins.size(); ++i)
    if (pins.pinned(i)) dirty[static_cast<Eigen::Index>(i)] = 3;
  CHECK(solveWith(factor, dirty) == solveWith(factor, b));
  CHECK_FALSE(factor.factorise(symmetricBlocks(pattern, dense), Pins(nodes)));
}

TEST_CASE("indefinite, singular and non-finite matrices are refused, and the factor stays usable") {
  const std::int32_t nodes = 15;
  const auto pattern = ringPattern(nodes);
  std::mt19937 random(3);
  const Eigen::MatrixXd good = randomPositive(*pattern, random);
  const Pins none(nodes);
  CholeskyFactor factor(std::make_shared<const CholeskyAnalysis>(pattern));
  const Eigen::VectorXd b = Eigen::VectorXd::Random(3 * nodes);
  const auto isGood = [&] {
    REQUIRE(factor.factorise(symmetricBlocks(pattern, good), none));
    CHECK((good * solveWith(factor, b) - b).norm() < 1e-12);
  };
  isGood();
  for (const int row : {0, 22, 3 * nodes - 1}) {
    Eigen::MatrixXd indefinite = good;
    indefinite(row, row) = -0.5;
    CHECK_FALSE(factor.factorise(symmetricBlocks(pattern, indefinite), none));
    isGood();
    Eigen::MatrixXd singular = good;
    singular.row(row).setZero();
    singular.col(row).setZero();
    CHECK_FALSE(factor.factorise(symmetricBlocks(pattern, singular), none));
    isGood();
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Eigen::MatrixXd broken = good;
      broken(row, row) = bad;
      CHECK_FALSE(factor.factorise(symmetricBlocks(pattern, broken), none));
      isGood();
    }
  }
  CHECK_FALSE(factor.factorise(symmetricBlocks(pattern, -good), none));
}

TEST_CASE("a factorisation that is stopped says so, and the next one is as ever") {
  const std::int32_t nodes = 40;
  const auto pattern = ringPattern(nodes);
  std::mt19937 random(4);
  const auto matrix = symmetricBlocks(pattern, randomPositive(*pattern, random));
  const Pins pins(nodes);
  CholeskyFactor factor(std::make_shared<const CholeskyAnalysis>(pattern));
  REQUIRE(factor.factorise(matrix, pins));
  const Eigen::VectorXd b = Eigen::VectorXd::Random(3 * nodes);
  const auto expected = solveWith(factor, b);
  std::stop_source before, midst;
  before.request_stop();
  CHECK_FALSE(factor.factorise(matrix, pins, before.get_token()));
  {
    const PieceListening listening([&](std::string_view, bool) { midst.request_stop(); });  // once it has begun
    CHECK_FALSE(factor.factorise(matrix, pins, midst.get_token()));
  }
  REQUIRE(factor.factorise(matrix, pins, std::stop_source().get_token()));
  CHECK(solveWith(factor, b) == expected);
}

TEST_CASE("a factor can be moved: the new owner solves, and an assigned-over one takes the other's matrix") {
  const std::int32_t nodes = 10;
  const auto pattern = ringPattern(nodes);
  const auto analysis = std::make_shared<const CholeskyAnalysis>(pattern);
  std::mt19937 random(4);
  const Eigen::MatrixXd one = randomPositive(*pattern, random), two = randomPositive(*pattern, random);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(3 * nodes);
  CholeskyFactor first(analysis), second(analysis);
  REQUIRE(first.factorise(symmetricBlocks(pattern, one), Pins(nodes)));
  REQUIRE(second.factorise(symmetricBlocks(pattern, two), Pins(nodes)));
  const Eigen::VectorXd by_one = solveWith(first, b), by_two = solveWith(second, b);
  CHECK((by_one - by_two).norm() > 1e-3);

  CholeskyFactor moved(std::move(first));
  CHECK((solveWith(moved, b) - by_one).norm() == 0);
  moved = std::move(second);
  CHECK((solveWith(moved, b) - by_two).norm() == 0);
  std::vector<CholeskyFactor> many;
  for (int k = 0; k < 5; ++k) many.emplace_back(analysis);
  for (auto& factor : many) REQUIRE(factor.factorise(symmetricBlocks(pattern, one), Pins(nodes)));
  CHECK((solveWith(many.front(), b) - by_one).norm() == 0);
}

TEST_CASE("factors of one analysis work in parallel threads and give what one thread gives, bit by bit") {
  const std::int32_t nodes = 60;
  const auto pattern = ringPattern(nodes);
  const auto analysis = std::make_shared<const CholeskyAnalysis>(pattern);
  constexpr std::size_t kThreads = 6;
  std::mt19937 random(5);
  std::vector<SymmetricBlockMatrix> matrices;
  for (std::size_t t = 0; t < kThreads; ++t)
    matrices.push_back(symmetricBlocks(pattern, randomPositive(*pattern, random)));
  const Eigen::VectorXd b = Eigen::VectorXd::Random(3 * nodes);
  const auto run = [&](std::size_t t) {
    Eigen::VectorXd x = b;
    for (int repeat = 0; repeat < 20; ++repeat) {
      CholeskyFactor factor(analysis);
      if (!factor.factorise(matrices[t], Pins(nodes))) return Eigen::VectorXd(Eigen::VectorXd::Zero(b.size()));
      factor.solve(x.data(), x.data());
    }
    return x;
  };
  std::vector<Eigen::VectorXd> alone(kThreads), together(kThreads);
  for (std::size_t t = 0; t < kThreads; ++t) alone[t] = run(t);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < kThreads; ++t) threads.emplace_back([&, t] { together[t] = run(t); });
  }
  for (std::size_t t = 0; t < kThreads; ++t) {
    CHECK(alone[t].norm() > 0);
    CHECK((alone[t] - together[t]).norm() == 0);
  }
}

TEST_CASE("one factor serves several threads at once") {
  const std::int32_t nodes = 60;
  const auto pattern = ringPattern(nodes);
  std::mt19937 random(6);
  CholeskyFactor factor(std::make_shared<const CholeskyAnalysis>(pattern));
  REQUIRE(factor.factorise(symmetricBlocks(pattern, randomPositive(*pattern, random)), Pins(nodes)));
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(3 * nodes, 4);
  Eigen::MatrixXd together(b.rows(), b.cols());
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (int repeat = 0; repeat < 50; ++repeat) factor.solve(b.col(t).data(), together.col(t).data());
      });
  }
  for (int t = 0; t < 4; ++t) CHECK((together.col(t) - solveWith(factor, b.col(t))).norm() == 0);
}

TEST_CASE("patterns without couplings and of a single node can be factorised") {
  for (const std::int32_t nodes : {1, 3}) {
    const auto pattern = std::make_shared<const BlockPattern>(nodes, std::vector<std::vector<std::int32_t>>{});
    std::mt19937 random(7);
    const Eigen::MatrixXd dense = randomPositive(*pattern, random);
    CholeskyFactor factor(std::make_shared<const CholeskyAnalysis>(pattern));
    REQUIRE(factor.factorise(symmetricBlocks(pattern, dense), Pins(nodes)));
    const Eigen::VectorXd b = Eigen::VectorXd::Random(3 * nodes);
    CHECK((dense * solveWith(factor, b) - b).norm() < 1e-13);
  }
}
