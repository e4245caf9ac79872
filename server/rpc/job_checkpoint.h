#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "server/jobs/job_runner.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {

/// The checkpoint of one job: found where an earlier process left it, written as time goes by. One thread at a time.
class JobCheckpoint {
 public:
  JobCheckpoint(const JobRun& run, std::chrono::duration<double> every)
      : run_(run), path_(run.folder / "checkpoint.safetensors"), every_(every) {}

  /// What is there, as `read` makes it of the file, if its `training` is this one; a damaged or foreign one is told in
  /// the log and left aside.
  template <class Read>
  auto find(const std::string& training, const Read& read) const
      -> std::optional<decltype(read(std::filesystem::path()))> {
    if (!std::filesystem::exists(path_)) return std::nullopt;
    try {
      auto checkpoint = read(path_);
      if (checkpoint.training == training) return checkpoint;
      logError("job " + run_.job.id + " begins anew: " + path_.string() + " is of another training");
    } catch (const std::exception& problem) {
      logError("job " + run_.job.id + " begins anew: " + problem.what());
    }
    return std::nullopt;
  }

  /// Keeps what `write` puts into the file when the last one is old, or the job is to stop. A disk that takes none does
  /// not end the job.
  void offer(const std::function<void(const std::filesystem::path&)>& write);

 private:
  using Clock = std::chrono::steady_clock;

  const JobRun& run_;
  const std::filesystem::path path_;
  const std::chrono::duration<double> every_;
  Clock::time_point kept_ = Clock::now();
};

}  // namespace shaped::server
