#pragma once

#include <filesystem>

#include "core/mocap/marker_tracker.h"

namespace shaped {

/// Where the fit of a take stands.
struct MarkerFitterCheckpoint {
  std::int64_t frames = 0;   ///< that have been fitted
  MarkerTrackerState state;  ///< after them
};

/// Writes the file; it appears only when complete. Throws FileError.
void writeFitterCheckpoint(const std::filesystem::path& path, const MarkerFitterCheckpoint& checkpoint);

/// Throws InvalidInput naming the file and what is wrong when it is damaged, of another format, or no such checkpoint.
MarkerFitterCheckpoint readFitterCheckpoint(const std::filesystem::path& path);

}  // namespace shaped
