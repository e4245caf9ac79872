#include "core/skeleton/skeleton.h"

#include <set>

#include "core/numerics/error.h"

namespace shaped {

Skeleton::Skeleton(std::vector<Joint> joints) : joints_(std::move(joints)) {
  if (joints_.empty()) throw InvalidInput("joints", "is empty, want at least one");
  std::set<std::string_view> names;
  for (std::int32_t j = 0; j < jointCount(); ++j) {
    const std::string where = "joints[" + std::to_string(j) + "]";
    if (name(j).empty()) throw InvalidInput(where, "has no name");
    if (!names.insert(name(j)).second) throw InvalidInput(where, "repeats the name \"" + name(j) + "\"");
    if (j == 0 && parent(j) != -1)
      throw InvalidInput(where, "has parent " + std::to_string(parent(j)) + ", want -1: the first joint is the root");
    if (j > 0 && (parent(j) < 0 || parent(j) >= j))
      throw InvalidInput(where, "has parent " + std::to_string(parent(j)) + ", want 0 to " + std::to_string(j - 1) +
                                    ": there is one root, and parents come before children");
  }
}

std::optional<std::int32_t> Skeleton::find(std::string_view wanted) const {
  for (std::int32_t j = 0; j < jointCount(); ++j)
    if (name(j) == wanted) return j;
  return std::nullopt;
}

}  // namespace shaped
