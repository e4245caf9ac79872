#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

namespace shaped::server {

/// Durations counted in buckets that each are 5 % wider than the last, so that any quantile is known to 2.5 %: the idea
/// of DDSketch (Masson, Rim, Lee 2019) over a fixed range, 1 us to 28 hours. Mergeable: counts add up. Empty it takes
/// no memory but its own: a daemon has hundreds, most of methods that nobody calls.
class Sketch {
 public:
  /// seconds: clamped into the range; what is no number counts as the smallest.
  void observe(double seconds);
  void merge(const Sketch& other);
  std::uint64_t count() const { return count_; }
  /// fraction in [0, 1]: 0.5 is the median; 0 when nothing was observed [s].
  double quantile(double fraction) const;

 private:
  static constexpr std::size_t kBuckets = 520;
  std::vector<std::uint32_t> counts_;  ///< kBuckets, or none while nothing was observed
  std::uint64_t count_ = 0;
};

/// A sketch of the last minute, in slices of ten seconds: holds what was observed 50 to 60 seconds before now.
class RecentSketch {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kSlice{10};
  static constexpr std::size_t kSlices = 6;

  /// now: never before an earlier call's, but for a slice at most.
  void observe(double seconds, Clock::time_point now);
  /// All slices that are not too old, merged.
  Sketch recent(Clock::time_point now) const;

 private:
  struct Slice {
    std::int64_t number = -1;  ///< of ten seconds since the clock's beginning
    Sketch sketch;
  };
  std::array<Slice, kSlices> slices_;
};

}  // namespace shaped::server
