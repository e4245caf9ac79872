#include "server/models/eviction.h"

#include <catch2/catch.hpp>

using namespace shaped::server;

TEST_CASE("eviction frees the memory of what was used longest ago and nobody holds") {
  using Plan = std::optional<std::vector<std::size_t>>;
  struct Row {
    const char* what;
    std::vector<Resident> residents;
    std::size_t needed, budget;
    Plan plan;
  };
  const std::vector<Row> table{
      {"an empty memory takes what fits", {}, 10, 10, Plan{std::vector<std::size_t>{}}},
      {"and nothing larger", {}, 11, 10, {}},
      {"room enough", {{4, 1, false}}, 6, 10, Plan{std::vector<std::size_t>{}}},
      {"the oldest goes", {{4, 2, false}, {4, 1, false}}, 6, 10, Plan{std::vector<std::size_t>{1}}},
      {"as many as needed, oldest first", {{4, 3, false}, {3, 1, false}, {3, 2, false}}, 6, 10, Plan{std::vector<std::size_t>{1, 2}}},
      {"a held one stays", {{4, 1, true}, {4, 2, false}}, 6, 10, Plan{std::vector<std::size_t>{1}}},
      {"held ones leave no room", {{4, 1, true}, {4, 2, false}}, 7, 10, {}},
      {"above the budget already", {{8, 1, true}, {8, 2, false}}, 0, 10, Plan{std::vector<std::size_t>{1}}},
  };
  for (const auto& row : table) {
    CAPTURE(row.what);
    CHECK(planEviction(row.residents, row.needed, row.budget) == row.plan);
  }
}
