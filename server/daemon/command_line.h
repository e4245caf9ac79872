#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/daemon/options.h"

namespace shaped::server {

/// What a command line asks for.
struct CommandLine {
  enum class Action { kServe, kCheck, kHelp, kVersion };
  Action action = Action::kServe;
  std::optional<std::filesystem::path> config;  ///< of --config, absolute
  DaemonOptions options;                        ///< the file's, overridden by the words; unset for help and version
};

/// Reads the words of a command line (without the program's name) and the configuration file they name; default_threads
/// stands in for --threads. Throws InvalidInput naming the option, or the file and its line.
CommandLine parseCommandLine(const std::vector<std::string>& words, int default_threads);

/// What --help prints.
std::string usage();

/// The options in force, a line each, as a configuration file has them.
std::string describe(const DaemonOptions& options);

}  // namespace shaped::server
