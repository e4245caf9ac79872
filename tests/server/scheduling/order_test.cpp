#include "server/scheduling/order.h"

#include <catch2/catch.hpp>

using namespace shaped::server;

namespace {

constexpr double ageing = 10;
constexpr auto interactive = Priority::kInteractive, normal = Priority::kNormal, batch = Priority::kBatch;

struct Row {
  const char* name;
  std::vector<Line> lines;  ///< priority, waited, running, served
  std::size_t next;
};

const std::vector<Row> table{
    {"the only line", {{batch, 0, 5, 100}}, 0},
    {"the more urgent", {{normal, 9, 0, 0}, {interactive, 0, 9, 99}, {batch, 9, 0, 0}}, 1},
    {"in a class, the client with fewer running requests", {{normal, 9, 2, 0}, {normal, 0, 1, 99}}, 1},
    {"then the one less was spent on", {{normal, 9, 1, 5}, {normal, 0, 1, 4}}, 1},
    {"then the one that has waited longer", {{normal, 2, 1, 5}, {normal, 3, 1, 5}}, 1},
    {"the first where nothing decides", {{normal, 2, 1, 5}, {normal, 2, 1, 5}}, 0},
    {"not yet of the next class", {{normal, 9.99, 0, 0}, {interactive, 0, 3, 50}}, 1},
    {"of the next class", {{normal, 10, 0, 0}, {interactive, 0, 3, 50}}, 0},
    {"batch is normal after one wait", {{batch, 10, 0, 0}, {normal, 0, 1, 0}}, 0},
    {"and not interactive", {{batch, 19.9, 0, 0}, {interactive, 0, 9, 99}}, 1},
    {"which it is after two", {{batch, 20, 0, 0}, {interactive, 0, 9, 99}}, 0},
    {"nothing is more urgent than interactive", {{batch, 1000, 1, 0}, {interactive, 0, 0, 99}}, 1},
    {"a client's own lines by their wait", {{interactive, 1, 1, 7}, {batch, 25, 1, 7}}, 1},
};

/// One worker, one second a request; interactive clients who always have a request waiting, and one batch request.
/// Returns when it runs [s].
int secondsUntilBatchRuns(int clients) {
  std::vector<Line> lines(static_cast<std::size_t>(clients), Line{interactive, 0, 0, 0});
  lines.push_back({batch, 0, 0, 0});
  for (int second = 0; second < 10'000; ++second) {
    const auto chosen = next(lines, ageing);
    if (lines[chosen].priority == batch) return second;
    for (auto& line : lines) line.waited += 1;
    lines[chosen].waited = 0;
    lines[chosen].served += 1;
  }
  return -1;
}

}  // namespace

TEST_CASE("the next request is that of the urgent, the fairly treated, the patient") {
  for (const auto& row : table) {
    INFO(row.name);
    CHECK(next(row.lines, ageing) == row.next);
  }
}

TEST_CASE("batch runs although interactive requests never end") {
  // It is interactive after 20 s, and then one that has had nothing.
  CHECK(secondsUntilBatchRuns(1) == 20);
  CHECK(secondsUntilBatchRuns(7) == 20);
  CHECK(secondsUntilBatchRuns(50) == 50);  // thirty others have waited for their first turn as long
}
