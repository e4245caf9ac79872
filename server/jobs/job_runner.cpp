#include "server/jobs/job_runner.h"

#include <algorithm>

#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "server/jobs/arena.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// How long until a storage that failed is tried again.
constexpr auto kRetry = 1000ms;
/// A job that another process queued is found at the latest after this time.
constexpr auto kLook = 10000ms;

void setEnded(JobRecord& record, JobState state) {
  record.state = state;
  record.ended = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

/// Asked to stop: by its user, or by a daemon that is leaving, which then wants it to go on later.
void markStopped(JobRecord& record) {
  if (record.cancel_requested)
    setEnded(record, JobState::kCancelled);
  else
    record.state = JobState::kQueued;
}

void markFailed(JobRecord& record, const std::string& error, int code) {
  setEnded(record, JobState::kFailed);
  record.error = error;
  record.error_code = code;
}

void markSucceeded(JobRecord& record) {
  setEnded(record, JobState::kSucceeded);
  record.fraction = 1;
}

void markEnded(JobRecord& record, const JobResult& result) {
  if (result.outcome.termination == Termination::kCancelled) markStopped(record);
  if (record.state == JobState::kQueued) return;
  record.result = result;
  if (hasEnded(record.state)) return;
  if (result.failure.empty())
    markSucceeded(record);
  else
    markFailed(record, result.failure, grpc::FAILED_PRECONDITION);
}

std::string crashText(int crashes) {
  return "the daemon died " + std::to_string(crashes) +
         " times while it ran this job, without a checkpoint in between; it may need more memory than there is: see "
         "the daemon's log, and train with fewer shapes or coarse_vertices";
}

}  // namespace

JobRunner::JobRunner(JobRegistry& registry, Kinds kinds, const JobLimits& limits, fs::path folder)
    : registry_(registry), kinds_(std::move(kinds)), limits_(limits), folder_(std::move(folder)) {
  for (const auto& left : registry_.takeOver()) settle(left);
  registry_.forgetOld(limits_.retention);
  removeStrayFolders();
  for (int i = 0; i < limits_.running; ++i) threads_.emplace_back([this] { serve(); });
}

JobRunner::~JobRunner() {
  leave();
  for (auto& thread : threads_) thread.join();
}

void JobRunner::settle(const JobRecord& left) {
  const auto kind = kinds_.find(left.kind);
  const auto version = kind == kinds_.end() ? 0 : kind->second.published(left);
  registry_.update(left.id, [&](JobRecord& record) {
    if (version != 0) {
      if (!record.result) record.result.emplace().model_name = record.model_name;
      record.result->model_version = version;
      markSucceeded(record);
    } else if (record.cancel_requested) {
      setEnded(record, JobState::kCancelled);
    } else if (record.crashes >= limits_.crashes) {
      markFailed(record, crashText(record.crashes), grpc::ABORTED);
    } else {
      record.state = JobState::kQueued;
    }
  });
  logInfo("job " + left.id + " was left by a daemon that died: " +
          (version != 0 ? "its model is published" : "attempt " + std::to_string(left.attempts) + " has crashed"));
}

void JobRunner::removeStrayFolders() const {
  fs::create_directories(folder_);
  const auto goesOn = [&](const std::string& id) {
    try {
      return !hasEnded(registry_.get(id).state);
    } catch (const NotFound&) {
      return false;
    }
  };
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (!goesOn(entry.path().filename().string())) {
      fs::remove_all(entry.path());
      continue;
    }
    // What a writer had not yet given its name.
    for (const auto& file : fs::directory_iterator(entry.path()))
      if (file.path().filename().string().find(".partial-") != std::string::npos) fs::remove(file.path());
  }
}

JobRecord JobRunner::start(JobRecord wanted) {
  auto record = registry_.create(std::move(wanted), limits_.waiting);
  const std::scoped_lock lock(mutex_);
  ++wakes_;
  wake_.notify_one();
  return record;
}

JobRecord JobRunner::cancel(const std::string& job) {
  registry_.update(job, [](JobRecord& record) {
    record.cancel_requested = true;
    if (record.state == JobState::kQueued) markStopped(record);
  });
  {
    const std::scoped_lock lock(mutex_);
    if (const auto found = stops_.find(job); found != stops_.end()) found->second.request_stop();
  }
  const auto record = registry_.get(job);
  std::error_code ignored;  // at the next start it goes anyway
  if (record.state == JobState::kCancelled) fs::remove_all(folderOf(job), ignored);
  return record;
}

void JobRunner::leave() {
  const std::scoped_lock lock(mutex_);
  leaving_ = true;
  for (auto& [id, stop] : stops_) stop.request_stop();
  wake_.notify_all();
}

void JobRunner::serve() {
  while (const auto job = claimSoon()) run(*job);
}

/// Sleeps until the time is up, or a job has come since `wakes_` was `seen`; false when the runner is leaving.
bool JobRunner::pause(std::chrono::milliseconds time, std::uint64_t seen) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, time, [&] { return leaving_ || wakes_ != seen; });
  return !leaving_;
}

std::optional<JobRecord> JobRunner::claimSoon() {
  while (true) {
    std::uint64_t seen = 0;
    {
      const std::scoped_lock lock(mutex_);
      if (leaving_) return std::nullopt;
      seen = wakes_;
    }
    auto wait = kLook;
    try {
      if (auto job = registry_.claim()) return job;
    } catch (const std::exception& problem) {
      logError(std::string("no job can be begun: ") + problem.what());
      wait = kRetry;
    }
    if (!pause(wait, seen)) return std::nullopt;
  }
}

std::stop_token JobRunner::enter(const std::string& id) {
  std::stop_source stop;
  {
    const std::scoped_lock lock(mutex_);
    stops_[id] = stop;
    if (leaving_) stop.request_stop();
  }
  // Cancelled between the claim and here, where there was nothing to stop.
  if (registry_.get(id).cancel_requested) stop.request_stop();
  return stop.get_token();
}

JobRun JobRunner::runOf(const JobRecord& job, std::stop_token stop) {
  const auto& id = job.id;
  return {job,
          folderOf(id),
          [this, id](const Progress& progress) { registry_.report(id, progress); },
          std::move(stop),
          [this, id](const std::string& stage) {
            registry_.update(id, [&](JobRecord& record) { record.resumed_from = stage; });
          },
          [this, id] {
            if (registry_.get(id).crashes > 0) registry_.update(id, [](JobRecord& record) { record.crashes = 0; });
          },
          [this, id](const JobResult& result) {
            registry_.update(id, [&](JobRecord& record) { record.result = result; });
          }};
}

/// Records how a run ended, however long that takes on a full disk; false when the runner left before: then the next
/// start finds out what became of the job.
bool JobRunner::end(const std::string& id, const std::function<void(JobRecord&)>& change) {
  for (bool told = false;;) {
    try {
      registry_.update(id, change);
      return true;
    } catch (const std::exception& problem) {
      if (!told) logError("the end of job " + id + " cannot be recorded, trying again: " + problem.what());
      told = true;
    }
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, kRetry, [&] { return leaving_; })) return false;
  }
}

void JobRunner::run(const JobRecord& job) {
  std::function<void(JobRecord&)> how_it_ended = markStopped;
  try {
    const auto run = runOf(job, enter(job.id));
    const auto kind = kinds_.find(job.kind);
    if (kind == kinds_.end()) throw NotFound("this daemon knows no jobs of kind \"" + job.kind + "\"");
    fs::create_directories(run.folder);
    JobResult result;
    runInArena(limits_.threads, [&] { result = kind->second.work(run); });
    how_it_ended = [result](JobRecord& record) { markEnded(record, result); };
  } catch (const Stopped&) {
  } catch (...) {
    const auto status = statusOf(std::current_exception(), StopReason::kNone);
    how_it_ended = [status](JobRecord& record) { markFailed(record, status.error_message(), status.error_code()); };
  }
  const bool recorded = end(job.id, how_it_ended);
  {
    const std::scoped_lock lock(mutex_);
    stops_.erase(job.id);
  }
  try {
    if (!recorded || !hasEnded(registry_.get(job.id).state)) return;
    fs::remove_all(folderOf(job.id));
    registry_.forgetOld(limits_.retention);
  } catch (const std::exception& problem) {
    logError("after job " + job.id + ": " + problem.what());
  }
}

}  // namespace shaped::server
