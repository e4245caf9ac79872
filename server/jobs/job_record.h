#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/numerics/solved.h"

namespace shaped::server {

enum class JobState { kQueued, kRunning, kSucceeded, kFailed, kCancelled };

constexpr bool hasEnded(JobState state) { return state != JobState::kQueued && state != JobState::kRunning; }

/// What a job leaves behind.
struct JobResult {
  std::string model_name;
  std::uint64_t model_version = 0;  ///< 0: nothing was published
  Outcome outcome;                  ///< of the solver
  double seconds = 0;               ///< wall-clock time of the work
  double smallest_area_ratio = 0;   ///< see job.proto
};

/// All that is known of a job; a value, copied freely.
struct JobRecord {
  using Time = std::chrono::system_clock::time_point;

  std::string id;
  std::string model_name, dataset;
  JobState state = JobState::kQueued;
  std::string stage;
  double fraction = 0;  ///< 0 to 1, never falling
  double residual = 0;
  Time created;
  std::optional<Time> started, ended;
  std::optional<JobResult> result;  ///< once the solver has ended
  std::string error;                ///< once kFailed
  int error_code = 0;               ///< gRPC status code of `error`
};

}  // namespace shaped::server
