#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/scheduling/admission.h"

namespace shaped::server {

struct DaemonOptions {
  std::string listen = "127.0.0.1:50051";  ///< host:port, port 0 for any free one, or unix:PATH
  std::filesystem::path store;             ///< models and datasets; made when missing
  int threads = 1;                         ///< of the solvers, and of the training job, 1 .. 1024
  double longest_call = 600;               ///< cap on a call, and on a stream's time between messages [s], > 0
  double publish_patience = 300;           ///< how long a trained model waits for room on a full disk [s], >= 0
  AdmissionLimits limits;
  std::string log = "info";  ///< debug, info, warn, error
};

/// Parses the words of a command line (without the program's name); default_threads stands in for --threads. Nothing
/// when help is asked for. Throws InvalidInput naming the option.
std::optional<DaemonOptions> parseOptions(const std::vector<std::string>& words, int default_threads);

/// What --help prints.
std::string usage();

}  // namespace shaped::server
