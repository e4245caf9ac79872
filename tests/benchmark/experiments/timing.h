#pragma once

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace shaped::experiments {

/// Parallel loops run on the calling thread alone while this lives, so that the process's CPU time is that of one
/// thread.
class OneThread {
 public:
  OneThread() : control_(tbb::global_control::max_allowed_parallelism, 1) {}

 private:
  tbb::global_control control_;
};

/// CPU seconds of the whole process, and wall seconds, since construction.
class Stopwatch {
 public:
  Stopwatch() : cpu_(std::clock()), wall_(std::chrono::steady_clock::now()) {}

  double cpu() const { return static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC; }
  double wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count(); }

 private:
  std::clock_t cpu_;
  std::chrono::steady_clock::time_point wall_;
};

/// The middle value of at least one number.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace shaped::experiments
