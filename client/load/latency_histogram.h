#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

namespace shaped::client {

/// Durations counted in buckets of equal relative width, 128 for each doubling, so that any quantile of 1 ns to 73
/// years is known to 0.4 %: the layout of HdrHistogram (Tene). The extremes are kept exactly.
class LatencyHistogram {
 public:
  LatencyHistogram();

  /// Less than nothing counts as nothing.
  void record(std::chrono::nanoseconds duration);
  std::uint64_t count() const { return count_; }
  /// The smallest recorded value that at least this fraction, in [0, 1], of all does not exceed; 0 when there is none.
  std::chrono::nanoseconds quantile(double fraction) const;
  std::chrono::nanoseconds max() const { return std::chrono::nanoseconds(static_cast<std::int64_t>(max_)); }
  /// 0 when there is none.
  std::chrono::nanoseconds mean() const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0, max_ = 0;
  double sum_ = 0;  // [ns]
};

}  // namespace shaped::client
