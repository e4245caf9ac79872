#pragma once

#include <cstddef>
#include <vector>

#include "server/scheduling/priority.h"

namespace shaped::server {

/// The waiting requests of one client and one priority, which are served as they came.
struct Line {
  Priority priority = Priority::kNormal;
  double waited = 0;        ///< since its latest request began to run, or its first came [s], >= 0
  std::size_t running = 0;  ///< requests of the client that run
  double served = 0;        ///< time that workers have spent on the client, as RequestQueue counts it [s]
};

/// Which line's first request runs next: that of the most urgent class; within a class that of the client with the
/// fewest running requests, then of the one on which the least time was spent, then the one that has waited longest.
/// A line that waits moves up one class every `ageing` seconds (> 0), until its first request runs. So none waits for
/// ever: in the most urgent class it is overtaken only by clients on whom less time was spent, and each overtaking
/// spends some. And a client who has sent a lot at once gains nothing by its age: his line moves.
/// lines: not empty.
std::size_t next(const std::vector<Line>& lines, double ageing);

}  // namespace shaped::server
