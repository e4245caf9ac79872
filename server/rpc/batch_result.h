#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>

#include "server/jobs/record_file.h"
#include "server/rpc/job_context.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {

/// The answers of a batch job on their way to the disk, and the state that goes with them: what an earlier process left
/// is found, and written on. One thread at a time.
class BatchResult {
 public:
  /// method: for the counts, "Jobs.Project". works_on: a fingerprint of what the job works on; what was left by work on
  /// something else (a dataset of the same name, say) is forgotten.
  BatchResult(const JobContext& context, const JobRun& run, std::string method, const std::string& works_on);

  /// The state that an earlier process has kept, as `read` makes it of the file; nothing when there is none, or it is
  /// damaged, which the log tells.
  template <class Read>
  auto find(const Read& read) const -> std::optional<decltype(read(std::filesystem::path()))> {
    if (!std::filesystem::exists(state_)) return std::nullopt;
    try {
      return read(state_);
    } catch (const std::exception& problem) {
      logError("job " + run_.job.id + " begins anew: " + problem.what());
      return std::nullopt;
    }
  }

  /// Goes on behind the first `keep` answers, or all that are whole (RecordWriter::kAll). False when there are not as
  /// many: then there are none.
  bool open(std::int64_t keep);
  /// Answers that are there.
  std::int64_t count() const { return writer_->count(); }

  /// Adds an answer. Throws InvalidInput when the result has become too large, and as patiently().
  void add(const v1::GetJobResultResponse& answer);
  /// Keeps all answers, and the state that `write` puts into a file, when the last time is long ago or the job is to
  /// stop. A disk that takes none does not end the job.
  void offer(const std::function<void(const std::filesystem::path&)>& write = {});

  /// All answers are there: on the disk once this returns. What the job leaves behind.
  JobResult finish();
  /// What a job returns that was stopped.
  JobResult stopped() const;

 private:
  void tally(const v1::GetJobResultResponse& answer);

  const JobContext& context_;
  const JobRun& run_;
  const std::string method_;
  const std::filesystem::path result_, state_;
  std::optional<RecordWriter> writer_;
  Outcome outcome_;
  double smallest_area_ratio_ = 1;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point kept_ = begin_;
};

}  // namespace shaped::server
