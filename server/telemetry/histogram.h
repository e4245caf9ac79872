#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace shaped::server {

/// Counts of values by size since the start, as Prometheus has them. A plain value: whoever shares it, locks it.
class Histogram {
 public:
  /// bounds: rising upper ends of the buckets, each inclusive; above the last there is one more bucket.
  explicit Histogram(std::span<const double> bounds)
      : bounds_(bounds.begin(), bounds.end()), counts_(bounds.size() + 1) {}

  void observe(double value);

  const std::vector<double>& bounds() const { return bounds_; }
  /// One a bucket, not cumulative; one more than bounds.
  const std::vector<std::uint64_t>& counts() const { return counts_; }
  std::uint64_t count() const { return count_; }
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  double sum_ = 0;
};

}  // namespace shaped::server
