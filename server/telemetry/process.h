#pragma once

#include <cstdint>

namespace shaped::server {

/// What the system says about this process.
struct ProcessStatistics {
  std::uint64_t resident_bytes = 0;
  std::uint64_t memory_limit_bytes = 0;  ///< of the container, or the machine's memory where that is less
  double cpu_seconds = 0;                ///< user and system, all threads
  std::uint64_t open_files = 0;
  std::uint64_t most_open_files = 0;  ///< the soft limit
  std::uint64_t threads = 0;
  double start_seconds = 0;  ///< since 1970
};

/// Reads /proc, a few 10 us; what cannot be read stays 0.
ProcessStatistics processStatistics();

}  // namespace shaped::server
