#include "server/telemetry/sketch.h"

#include <algorithm>
#include <cmath>

namespace shaped::server {
namespace {

constexpr double kSmallest = 1e-6;  // [s]
constexpr double kGrowth = 1.05;
const double kLogGrowth = std::log(kGrowth);

std::int64_t sliceOf(RecentSketch::Clock::time_point time) { return time.time_since_epoch() / RecentSketch::kSlice; }

}  // namespace

void Sketch::observe(double seconds) {
  const double place = seconds > kSmallest ? std::log(seconds / kSmallest) / kLogGrowth : 0;
  const auto bucket = static_cast<std::size_t>(std::min(place, static_cast<double>(kBuckets - 1)));
  counts_.resize(kBuckets);
  ++counts_[bucket];
  ++count_;
}

void Sketch::merge(const Sketch& other) {
  if (other.count_ == 0) return;
  counts_.resize(kBuckets);
  for (std::size_t i = 0; i < kBuckets; ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
}

double Sketch::quantile(double fraction) const {
  if (count_ == 0) return 0;
  const double rank = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(count_ - 1);
  std::uint64_t below = 0;
  std::size_t bucket = 0;
  for (; bucket + 1 < kBuckets; ++bucket) {
    below += counts_[bucket];
    if (static_cast<double>(below) > rank) break;
  }
  // The bucket's geometric middle is off by at most half its width, wherever in it the value was.
  return kSmallest * std::exp(kLogGrowth * (static_cast<double>(bucket) + 0.5));
}

void RecentSketch::observe(double seconds, Clock::time_point now) {
  const auto number = sliceOf(now);
  auto& slice = slices_[static_cast<std::size_t>(number) % kSlices];
  if (slice.number < number) slice = {number, {}};
  slice.sketch.observe(seconds);
}

Sketch RecentSketch::recent(Clock::time_point now) const {
  const auto oldest = sliceOf(now) - static_cast<std::int64_t>(kSlices) + 1;
  Sketch merged;
  for (const auto& slice : slices_)
    if (slice.number >= oldest) merged.merge(slice.sketch);
  return merged;
}

}  // namespace shaped::server
