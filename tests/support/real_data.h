#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

namespace shaped::test {

/// A file or folder of the real data sets, under the folder that the environment variable SHAPED_DATA names (default:
/// ~/.cache/shaped-data). Nothing, with a warning in the test's output, when it is not there: the test then returns.
std::optional<std::filesystem::path> realData(std::string_view relative_path);

}  // namespace shaped::test
