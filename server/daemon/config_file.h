#pragma once

#include <filesystem>
#include <vector>

#include "server/daemon/options.h"

namespace shaped::server {

/// The options of a YAML file: one mapping of names to values; a list of values is one value with commas. Throws
/// InvalidInput naming file and line when it is not of that form or has a name twice.
std::vector<GivenOption> readConfigFile(const std::filesystem::path& path);

}  // namespace shaped::server
