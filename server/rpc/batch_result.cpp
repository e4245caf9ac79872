#include "server/rpc/batch_result.h"

#include <algorithm>

#include "core/io/file.h"
#include "core/numerics/error.h"
#include "server/convert/report.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char *kState = "state.safetensors", *kWorksOn = "works_on";

struct Quality {
  Outcome outcome;
  double smallest_area_ratio;
};

template <class Response>
Quality qualityIn(const Response& response) {
  const auto& report = response.report();
  return {{terminationFromProto(report.termination()), report.iterations(), report.residual()},
          response.smallest_area_ratio()};
}

Quality qualityOf(const v1::GetJobResultResponse& answer) {
  if (answer.has_evaluate()) return qualityIn(answer.evaluate());
  return answer.has_project() ? qualityIn(answer.project()) : qualityIn(answer.fit_markers());
}

bool says(const fs::path& file, const std::string& text) {
  try {
    return fs::exists(file) && readFile(file) == text;
  } catch (const InvalidInput&) {
    return false;
  }
}

}  // namespace

BatchResult::BatchResult(const JobContext& context, const JobRun& run, std::string method, const std::string& works_on)
    : context_(context),
      run_(run),
      method_(std::move(method)),
      result_(run.folder / kResultFile),
      state_(run.folder / kState) {
  if (says(run.folder / kWorksOn, works_on)) return;
  fs::remove(state_);
  fs::remove(result_);
  patiently(context_, run_, [&] { writeFile(run.folder / kWorksOn, works_on); });
}

bool BatchResult::open(std::int64_t keep) {
  bool there = true;
  try {
    writer_.emplace(result_, keep);
  } catch (const Corrupted& problem) {
    logError("job " + run_.job.id + " begins anew: " + problem.what());
    there = false;
    writer_.emplace(result_, 0);
  }
  RecordReader reader(result_);
  v1::GetJobResultResponse answer;
  for (std::string record; reader.next(record);)
    if (answer.ParseFromString(record)) tally(answer);
  return there;
}

void BatchResult::tally(const v1::GetJobResultResponse& answer) {
  const auto [outcome, ratio] = qualityOf(answer);
  outcome_ += outcome;
  smallest_area_ratio_ = std::min(smallest_area_ratio_, ratio);
}

void BatchResult::add(const v1::GetJobResultResponse& answer) {
  const auto record = answer.SerializeAsString();
  const auto most = context_.limits.job_bytes;
  if (writer_->bytes() + std::ssize(record) > most)
    throw InvalidInput("job", "its result has become larger than " + std::to_string(most >> 20) +
                                  " MiB, the server's limit (--max-job-megabytes); leave the shapes out of the answers, "
                                  "or ask for fewer of them");
  patiently(context_, run_, [&] { writer_->append(record); });
  tally(answer);
  context_.metrics.method(method_).solved(qualityOf(answer).outcome);
}

void BatchResult::offer(const std::function<void(const fs::path&)>& write) {
  if (Clock::now() - kept_ < context_.checkpoint_every && !run_.stop.stop_requested()) return;
  kept_ = Clock::now();
  try {
    writer_->sync();  // first: a state must never know of answers that are not there
    if (write) write(state_);
    run_.checkpointed();
  } catch (const std::exception& problem) {
    logError("job " + run_.job.id + " goes on without a checkpoint: " + problem.what());
  }
}

JobResult BatchResult::finish() {
  patiently(context_, run_, [&] { writer_->sync(); });
  return {{}, 0, outcome_, std::chrono::duration<double>(Clock::now() - begin_).count(), smallest_area_ratio_, {}};
}

JobResult BatchResult::stopped() const { return {{}, 0, {Termination::kCancelled, 0, 0}, 0, 0, {}}; }

}  // namespace shaped::server
