#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace shaped::server {

/// A model in memory, as far as the memory budget is concerned.
struct Resident {
  std::size_t bytes = 0;
  std::uint64_t last_used = 0;  ///< larger is later
  bool held = false;            ///< by a request: it cannot give its memory back
};

/// Which models to drop, as indices, the least recently used first, so that `needed` more bytes fit into the budget.
/// Nothing when it cannot be done: then nothing is to be dropped.
std::optional<std::vector<std::size_t>> planEviction(std::span<const Resident> residents, std::size_t needed,
                                                     std::size_t budget);

}  // namespace shaped::server
