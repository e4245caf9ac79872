#include <set>

#include "core/io/handle_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_TARGET(handles) {
  const auto handles = accepted<InvalidInput>([&] { return parseHandles("handles.csv", bytes); });
  if (!handles) return;
  require(!handles->empty(), "there are handles");
  std::set<std::int32_t> vertices;
  for (const auto& [vertex, position] : *handles) {
    require(vertex >= 0 && vertices.insert(vertex).second, "a vertex has one handle");
    require(position.allFinite(), "positions are finite");
  }
}
