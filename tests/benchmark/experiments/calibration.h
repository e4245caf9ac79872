#pragma once

#include <vector>

#include "core/mesh/types.h"

namespace shaped::experiments {

/// Three frames spread over a trial, as `shapectl fit` takes them where all markers are seen.
inline std::vector<Vertices> calibrationFrames(const std::vector<Vertices>& frames) {
  std::vector<Vertices> chosen;
  for (std::size_t k = 0; k < 3; ++k) chosen.push_back(frames[k * frames.size() / 3]);
  return chosen;
}

}  // namespace shaped::experiments
