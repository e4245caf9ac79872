#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/numerics/solved.h"

namespace shaped::server {

enum class JobState { kQueued, kRunning, kSucceeded, kFailed, kCancelled };

constexpr bool hasEnded(JobState state) { return state != JobState::kQueued && state != JobState::kRunning; }

/// "queued", "running", "succeeded", "failed", "cancelled".
std::string nameOf(JobState state);

/// What a job leaves behind.
struct JobResult {
  std::string model_name;
  std::uint64_t model_version = 0;  ///< 0: nothing was published
  Outcome outcome;                  ///< of the solver
  double seconds = 0;               ///< wall-clock time of the work, in the process that ended it
  double smallest_area_ratio = 0;   ///< see job.proto
  std::string failure;              ///< why this is no success although nothing was thrown; empty: it is one
};

/// 128 random bits in hexadecimal.
std::string newJobKey();

/// All that is known of a job; a value, copied freely.
struct JobRecord {
  using Time = std::chrono::system_clock::time_point;  // for people: nothing is decided by it but retention

  std::string id;       ///< from the registry: unique in its store, also after deletions and restarts
  /// 32 hexadecimal digits, unique everywhere: marks what the job publishes, and is the name of its folder. From the
  /// registry, unless its creator has chosen one by newJobKey().
  std::string key;
  std::string kind;     ///< "train_shell_pga": names the work
  std::string request;  ///< what the work is to do, bytes of that kind's own
  std::string request_id;  ///< the client's, for creating a job once however often it asks; empty: none
  std::string model_name, dataset;
  JobState state = JobState::kQueued;
  bool cancel_requested = false;
  std::string stage;
  double fraction = 0;  ///< 0 to 1, never falling
  double residual = 0;
  Time created;
  std::optional<Time> started, ended;  ///< first start
  int attempts = 0;                    ///< how often it was started
  int crashes = 0;           ///< processes that died while they ran it, since it was queued or last kept a checkpoint
  std::string resumed_from;  ///< stage of the checkpoint that the latest start went on from; empty: the beginning
  std::optional<JobResult> result;  ///< once the solver has ended; without a version until that is published
  std::string error;                ///< once kFailed
  int error_code = 0;               ///< gRPC status code of `error`
};

}  // namespace shaped::server
