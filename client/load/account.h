#pragma once

#include <grpcpp/support/status_code_enum.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "client/load/latency_histogram.h"

namespace shaped::client {

/// What became of one call. Times count from the start of the run.
struct CallOutcome {
  std::chrono::nanoseconds intended{}, sent{}, ended{};
  grpc::StatusCode code = grpc::OK;
  std::string reason{};                              ///< the daemon's (docs/api.md), empty when something else answered
  std::uint64_t sent_bytes = 0, received_bytes = 0;  ///< of all messages of the call
};

/// The books of a run. Calls that were meant to be sent during the warm-up are left out.
class LoadAccount {
 public:
  /// deadline: what an answer must come within, from when it was meant to be sent, to count as good; none: any will do.
  LoadAccount(std::chrono::nanoseconds warm_up, std::chrono::nanoseconds duration,
              std::optional<std::chrono::nanoseconds> deadline)
      : warm_up_(warm_up), duration_(duration), deadline_(deadline) {}

  void record(const CallOutcome& outcome);
  /// A call whose time came in the run, and for which there was no room until its end.
  void recordUnsent(std::chrono::nanoseconds intended);

  std::uint64_t sent() const { return latency_.count() + failures_; }
  std::uint64_t unsent() const { return unsent_; }
  std::uint64_t answered() const { return latency_.count(); }
  std::uint64_t good() const { return good_; }
  /// From the end of the warm-up to the end of the run or of the last call, whichever is later [s]: what rates divide
  /// by.
  double seconds() const;
  double answersPerSecond() const { return static_cast<double>(answered()) / seconds(); }
  double goodPerSecond() const { return static_cast<double>(good_) / seconds(); }
  double sentBytesPerSecond() const { return static_cast<double>(sent_bytes_) / seconds(); }
  double receivedBytesPerSecond() const { return static_cast<double>(received_bytes_) / seconds(); }

  /// Of answers, from when they were meant to be sent.
  const LatencyHistogram& latency() const { return latency_; }
  /// Of answers, from when they were sent.
  const LatencyHistogram& service() const { return service_; }
  /// Of refusals (RESOURCE_EXHAUSTED), from when they were sent.
  const LatencyHistogram& refusals() const { return refusals_; }
  /// Of all calls: from when they were meant to be sent to when they were.
  const LatencyHistogram& delay() const { return delay_; }
  /// How many were sent more than a millisecond late.
  std::uint64_t late() const { return late_; }

  using Errors = std::map<std::pair<grpc::StatusCode, std::string>, std::uint64_t>;
  /// Code and reason -> how often.
  const Errors& errors() const { return errors_; }

 private:
  const std::chrono::nanoseconds warm_up_, duration_;
  const std::optional<std::chrono::nanoseconds> deadline_;
  LatencyHistogram latency_, service_, refusals_, delay_;
  Errors errors_;
  std::chrono::nanoseconds last_end_{};
  std::uint64_t failures_ = 0, unsent_ = 0, good_ = 0, late_ = 0, sent_bytes_ = 0, received_bytes_ = 0;
};

}  // namespace shaped::client
