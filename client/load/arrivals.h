#pragma once

#include <chrono>
#include <cstdint>
#include <random>

namespace shaped::client {

/// When requests are meant to be sent, whatever became of those before: an open loop, as many independent clients are.
/// A tool that waits for an answer before it sends again would send nothing while the daemon stalls, and hide the
/// stall.
class Arrivals {
 public:
  enum class Kind {
    kPoisson,  ///< independent clients: exponential gaps, so bursts come
    kFixed,    ///< equal gaps
  };

  /// rate: per second, > 0 and finite. The same seed gives the same times.
  /// Throws InvalidInput naming the rate.
  Arrivals(Kind kind, double rate, std::uint64_t seed);

  /// The next one, counted from the start; never before the one before. The first of kFixed is at 0.
  std::chrono::nanoseconds next();

 private:
  const Kind kind_;
  const double rate_;  // [1/s]
  std::mt19937_64 random_;
  std::exponential_distribution<double> gap_;
  double time_ = 0;  // of the latest one [s]
  std::uint64_t count_ = 0;
};

}  // namespace shaped::client
