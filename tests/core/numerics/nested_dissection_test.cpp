#include "core/numerics/nested_dissection.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <numeric>
#include <thread>

#include "core/numerics/cholesky.h"
#include "core/numerics/long_piece.h"
#include "tests/support/shapes.h"

#ifdef SHAPED_SUPERNODAL

using namespace shaped;
using namespace shaped::test;

namespace {

std::shared_ptr<const BlockPattern> patternOf(const Topology& topology) {
  std::vector<std::vector<std::int32_t>> stencils;
  for (const auto& [a, b] : topology.edges()) stencils.push_back({a, b});
  return std::make_shared<const BlockPattern>(topology.vertexCount(), stencils);
}

bool isPermutation(std::vector<std::int32_t> order, std::int32_t count) {
  std::sort(order.begin(), order.end());
  std::vector<std::int32_t> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return order == all;
}

/// Entries below the diagonal of the Cholesky factor, by elimination.
std::size_t fill(const BlockPattern& pattern, const std::vector<std::int32_t>& order) {
  std::vector<std::int32_t> position(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) position[order[i]] = static_cast<std::int32_t>(i);
  std::vector<std::vector<std::int32_t>> later(order.size());
  std::size_t sum = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    auto& row = later[i];
    for (const auto other : pattern.rows(order[i]))
      if (position[other] > static_cast<std::int32_t>(i)) row.push_back(position[other]);
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    sum += row.size();
    if (row.size() > 1) later[row[0]].insert(later[row[0]].end(), row.begin() + 1, row.end());
  }
  return sum;
}

}  // namespace

TEST_CASE("a large graph's order is a permutation with far less fill than the mesh's own") {
  const auto pattern = patternOf(*grid(90).topology);
  const auto order = nestedDissection(*pattern, {});
  REQUIRE(isPermutation(order, pattern->nodeCount()));
  std::vector<std::int32_t> own(order.size());
  std::iota(own.begin(), own.end(), 0);
  // n log n against the n sqrt(n) of row after row
  CHECK(fill(*pattern, order) < 0.4 * static_cast<double>(fill(*pattern, own)));
}

TEST_CASE("graphs without edges, in several parts, and with one node that all hang on are ordered") {
  constexpr std::int32_t count = 7000;
  std::vector<std::vector<std::int32_t>> none, star, chains;
  for (std::int32_t i = 1; i < count; ++i) {
    star.push_back({0, i});
    if (i % 3500 != 0) chains.push_back({i - 1, i});
  }
  for (const auto& stencils : {none, star, chains}) {
    const BlockPattern pattern(count, stencils);
    CHECK(isPermutation(nestedDissection(pattern, {}), count));
  }
}

TEST_CASE("dissections in several threads at once give what one alone gives") {
  const auto pattern = patternOf(*tube(200, 40).topology);
  const auto alone = nestedDissection(*pattern, {});
  std::vector<std::vector<std::int32_t>> together(4);
  for (int repeat = 0; repeat < 3; ++repeat) {
    {
      std::vector<std::jthread> threads;
      for (auto& order : together) threads.emplace_back([&] { order = nestedDissection(*pattern, {}); });
    }
    for (const auto& order : together) CHECK(order == alone);
  }
}

TEST_CASE("who else draws random numbers changes no dissection, and is not changed by it") {
  const auto pattern = patternOf(*tube(200, 40).topology);
  const auto alone = nestedDissection(*pattern, {});
  std::srand(5);
  const int first = std::rand(), second = std::rand();
  std::srand(5);
  CHECK(std::rand() == first);
  nestedDissection(*pattern, {});
  CHECK(std::rand() == second);
  const std::jthread other([](const std::stop_token& stop) {
    while (!stop.stop_requested()) std::rand();
  });
  for (int repeat = 0; repeat < 3; ++repeat) CHECK(nestedDissection(*pattern, {}) == alone);
}

TEST_CASE("a dissection leaves the handler of SIGTERM alone") {
  const auto pattern = patternOf(*tube(200, 40).topology);
  const auto ours = [](int) {};
  const auto before = std::signal(SIGTERM, ours);
  std::atomic<int> looks = 0, strange = 0;
  {
    const std::jthread watcher([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        struct sigaction now {};
        sigaction(SIGTERM, nullptr, &now);
        if (now.sa_handler != static_cast<void (*)(int)>(ours)) ++strange;
        ++looks;
      }
    });
    while (looks == 0) std::this_thread::yield();
    for (int repeat = 0; repeat < 3; ++repeat) nestedDissection(*pattern, {});
  }
  CHECK(looks > 10);
  CHECK(strange == 0);
  std::signal(SIGTERM, before);
}

TEST_CASE("a dissection that is stopped begins no further piece and gives nothing") {
  const auto pattern = patternOf(*tube(400, 40).topology);
  for (const int piece : {0, 1, 3, 6}) {
    std::stop_source stop;
    int count = 0, after = 0;
    const PieceListening listening([&](std::string_view, bool begins) {
      if (!begins) return;
      if (stop.stop_requested()) ++after;
      if (count++ == piece) stop.request_stop();
    });
    CHECK(CholeskyAnalysis::make(pattern, stop.get_token()) == nullptr);
    CHECK(stop.stop_requested());
    CHECK(after == 0);
  }
  CHECK(CholeskyAnalysis::make(pattern, {}) != nullptr);
}

#endif
