#include "server/models/eviction.h"

#include <algorithm>

namespace shaped::server {

std::optional<std::vector<std::size_t>> planEviction(std::span<const Resident> residents, std::size_t needed,
                                                     std::size_t budget) {
  if (needed > budget) return std::nullopt;
  std::size_t used = 0;
  std::vector<std::size_t> free, plan;
  for (std::size_t i = 0; i < residents.size(); ++i) {
    used += residents[i].bytes;
    if (!residents[i].held) free.push_back(i);
  }
  std::sort(free.begin(), free.end(),
            [&](std::size_t a, std::size_t b) { return residents[a].last_used < residents[b].last_used; });
  for (auto next = free.begin(); used > budget - needed; ++next) {
    if (next == free.end()) return std::nullopt;
    used -= residents[*next].bytes;
    plan.push_back(*next);
  }
  return plan;
}

}  // namespace shaped::server
