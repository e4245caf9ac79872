#include "tests/support/real_data.h"

#include <catch2/catch.hpp>
#include <cstdlib>

namespace shaped::test {

std::optional<std::filesystem::path> realData(std::string_view relative_path) {
  const char* folder = std::getenv("SHAPED_DATA");
  const char* home = std::getenv("HOME");
  const std::filesystem::path root =
      folder ? std::filesystem::path(folder) : std::filesystem::path(home ? home : ".") / ".cache" / "shaped-data";
  const auto path = root / relative_path;
  if (std::filesystem::exists(path)) return path;
  WARN("skipped: real data not found at " << path.string() << " (set SHAPED_DATA to its folder)");
  return std::nullopt;
}

}  // namespace shaped::test
