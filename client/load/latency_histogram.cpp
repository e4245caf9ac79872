#include "client/load/latency_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace shaped::client {
namespace {

constexpr unsigned kBits = 7;  // 2^kBits buckets for each doubling
constexpr std::uint64_t kPerDoubling = 1U << kBits;
constexpr std::size_t kBuckets = (64 - kBits) << kBits;

/// Doublings beyond the exact values, 0 .. 2 * kPerDoubling - 1.
unsigned shiftOf(std::uint64_t value) {
  const auto width = static_cast<unsigned>(std::bit_width(value));
  return width > kBits + 1 ? width - kBits - 1 : 0;
}

std::size_t bucketOf(std::uint64_t value) {
  const auto shift = shiftOf(value);
  return (static_cast<std::size_t>(shift) << kBits) + (value >> shift);
}

/// The middle of what falls into a bucket.
std::uint64_t valueOf(std::size_t bucket) {
  if (bucket < 2 * kPerDoubling) return bucket;
  const auto shift = (bucket >> kBits) - 1;
  const auto lowest = (kPerDoubling + (bucket & (kPerDoubling - 1))) << shift;
  return lowest + (std::uint64_t{1} << shift) / 2;
}

}  // namespace

LatencyHistogram::LatencyHistogram() : counts_(kBuckets) {}

void LatencyHistogram::record(std::chrono::nanoseconds duration) {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration.count(), 0));
  ++counts_[bucketOf(value)];
  ++count_;
  max_ = std::max(max_, value);
  sum_ += static_cast<double>(value);
}

std::chrono::nanoseconds LatencyHistogram::quantile(double fraction) const {
  if (count_ == 0) return {};
  const auto rank = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(count_))));
  std::uint64_t below = 0;
  std::size_t bucket = 0;
  while (below + counts_[bucket] < rank) below += counts_[bucket++];
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(valueOf(bucket), max_)));
}

std::chrono::nanoseconds LatencyHistogram::mean() const {
  return std::chrono::nanoseconds(count_ == 0 ? 0 : std::llround(sum_ / static_cast<double>(count_)));
}

}  // namespace shaped::client
