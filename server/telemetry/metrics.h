#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <vector>

#include "server/telemetry/statistics.h"

namespace shaped::server {

/// How one call went, for its method's counts.
struct CallOutcome {
  std::string code;            ///< gRPC status name
  double seconds = 0;          ///< from arrival to answer
  double queue_seconds = 0;    ///< waiting for a worker, all messages together
  double compute_seconds = 0;  ///< a worker's time on it, without waiting for the client
};

/// The counts of one method. Safe from any thread: a lock that is held for a fraction of a microsecond, never while
/// anything is computed out of the counts.
class MethodMetrics {
 public:
  explicit MethodMetrics(std::string name);

  void began();
  /// The call that began has ended.
  void ended(const CallOutcome& outcome);
  /// A solver has answered. Cancelled ones are the caller's doing and left out.
  void solved(const Outcome& outcome);

  MethodStatistics snapshot() const;

 private:
  struct Duration {
    Histogram total;
    RecentSketch recent;
    void observe(double seconds, RecentSketch::Clock::time_point now);
    DurationStatistics snapshot(RecentSketch::Clock::time_point now) const;
  };

  const std::string name_;
  std::atomic<std::int64_t> in_flight_{0};
  mutable std::mutex mutex_;  // of everything below
  std::map<std::string, std::uint64_t> by_code_;
  Duration request_, queue_, compute_;
  Histogram iterations_;
  std::map<Termination, std::uint64_t> unconverged_;
};

/// All that the daemon counts, and one snapshot of it with what others know. Safe from any thread.
class Metrics {
 public:
  /// surroundings: called for every snapshot; must be quick, and valid as long as this object.
  explicit Metrics(std::function<Surroundings()> surroundings);

  /// The counts of a method; made at the first call, there as long as this object. name: from the code
  /// ("Shapes.Project"), never from a client: each costs memory and a time series for ever.
  MethodMetrics& method(const std::string& name);
  void refused(RefusalCause cause) { ++refusals_[static_cast<std::size_t>(cause)]; }

  /// A job has ended. kind and state: from the code.
  void jobEnded(const std::string& kind, const std::string& state);
  /// Makes the count of such ends known, so that it begins at 0.
  void declareJobs(const std::string& kind, const std::string& state);

  Statistics snapshot() const;

 private:
  const std::function<Surroundings()> surroundings_;
  const std::chrono::system_clock::time_point started_;
  const std::chrono::steady_clock::time_point begin_;
  mutable std::shared_mutex mutex_;  // of the map, not of what it points to
  std::map<std::string, std::unique_ptr<MethodMetrics>> methods_;
  std::map<EndedJobs, std::uint64_t> ended_jobs_;
  std::array<std::atomic<std::uint64_t>, kRefusalCauses.size()> refusals_{};
};

}  // namespace shaped::server
