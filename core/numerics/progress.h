#pragma once

#include <functional>
#include <string>

namespace shaped {

/// Where a long computation stands.
struct Progress {
  std::string stage;    ///< what is being computed, for people: "mean, 4 steps"
  double fraction = 0;  ///< of the whole computation, 0 to 1, never falling
  double residual = 0;  ///< of the current stage's solver; 0 where it has none
};

/// Receives progress from any thread, one call at a time; must return quickly. Empty: nobody listens.
using ProgressSink = std::function<void(const Progress&)>;

}  // namespace shaped
