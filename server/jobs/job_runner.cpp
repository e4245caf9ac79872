#include "server/jobs/job_runner.h"

#include <algorithm>
#include <set>

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
         "the daemon's log, and ask for less at a time (a training: fewer shapes or coarse_vertices)";
}

}  // namespace

JobRunner::JobRunner(JobRegistry& registry, Kinds kinds, const JobLimits& limits, fs::path folder, Ended on_ended)
    : registry_(registry),
      kinds_(std::move(kinds)),
      limits_(limits),
      folder_(std::move(folder)),
      on_ended_(std::move(on_ended)) {
  fs::create_directories(folder_);
  for (const auto& left : registry_.takeOver()) settle(left);
  forgetOld();
  removeStrayFolders();
  for (int i = 0; i < limits_.running; ++i) threads_.emplace_back([this] { serve(); });
}

JobRunner::~JobRunner() {
  leave();
  for (auto& thread : threads_) thread.join();
}

bool JobRunner::publishes(const std::string& kind) const {
  const auto found = kinds_.find(kind);
  return found == kinds_.end() || found->second.published;
}

void JobRunner::settle(const JobRecord& left) {
  const auto kind = kinds_.find(left.kind);
  const auto version = kind == kinds_.end() || !kind->second.published ? 0 : kind->second.published(left);
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
  told(registry_.get(left.id));
}

void JobRunner::told(const JobRecord& job) const {
  if (on_ended_ && hasEnded(job.state)) on_ended_(job);
}

void JobRunner::removeStrayFolders() const {
  std::set<fs::path> known;
  JobQuery page{.states = {}, .after = {}, .limit = 1000};
  do {
    const auto records = registry_.list(page);
    for (const auto& record : records) {
      tidy(record);
      known.insert(folderOf(record));
    }
    page.after = records.size() == page.limit ? records.back().id : "";
  } while (!page.after.empty());
  for (const auto& entry : fs::directory_iterator(folder_))
    if (known.count(entry.path()) == 0) fs::remove_all(entry.path());
}

/// Leaves of a job's folder what is still needed: of one that goes on all but what a writer had not yet given its name,
/// of one that has succeeded the result.
void JobRunner::tidy(const JobRecord& job) const {
  const auto folder = folderOf(job);
  if (!fs::exists(folder)) return;
  const bool has_result = job.state == JobState::kSucceeded && fs::exists(folder / kResultFile);
  if (hasEnded(job.state) && !has_result) {
    fs::remove_all(folder);
    return;
  }
  for (const auto& file : fs::directory_iterator(folder)) {
    const auto name = file.path().filename().string();
    if (has_result ? name != kResultFile : name.find(".partial-") != std::string::npos) fs::remove_all(file.path());
  }
}

void JobRunner::forgetOld() const {
  for (const auto& job : registry_.forgetOld(limits_.retention)) fs::remove_all(folderOf(job));
  forgetLargeResults();
}

/// From the latest backwards, results are kept as long as they fit.
void JobRunner::forgetLargeResults() const {
  struct Kept {
    JobRecord job;
    std::uintmax_t bytes;
  };
  std::vector<Kept> kept;
  JobQuery page{.states = {JobState::kSucceeded}, .after = {}, .limit = 1000};
  do {
    const auto records = registry_.list(page);
    for (const auto& record : records) {
      std::error_code none;
      const auto bytes = fs::file_size(folderOf(record) / kResultFile, none);
      if (!none) kept.push_back({record, bytes});
    }
    page.after = records.size() == page.limit ? records.back().id : "";
  } while (!page.after.empty());
  std::uintmax_t sum = 0;
  for (auto item = kept.rbegin(); item != kept.rend(); ++item) {
    sum += item->bytes;
    if (item == kept.rbegin() || sum <= limits_.retention.result_bytes) continue;
    logInfo("job " + item->job.id + " is forgotten: the results that are kept have become too large");
    try {
      forget(item->job.id);
    } catch (const NotFound&) {  // a client has just done so
    }
  }
}

std::unique_ptr<JobInput> JobRunner::newInput() const { return std::make_unique<JobInput>(folder_, newJobKey()); }

JobRecord JobRunner::start(JobRecord wanted, JobInput* input) {
  if (input) {
    input->sync();
    wanted.key = input->key();
  }
  auto record = registry_.create(std::move(wanted), limits_.waiting);
  // From here on the job may run: its folder must not go any more.
  if (input && record.key == input->key()) input->release();
  const std::scoped_lock lock(mutex_);
  ++wakes_;
  wake_.notify_one();
  return record;
}

JobRecord JobRunner::cancel(const std::string& job) {
  bool waited = false;
  registry_.update(job, [&](JobRecord& record) {
    record.cancel_requested = true;
    waited = record.state == JobState::kQueued;
    if (waited) markStopped(record);
  });
  {
    const std::scoped_lock lock(mutex_);
    if (const auto found = stops_.find(job); found != stops_.end()) found->second.request_stop();
  }
  const auto record = registry_.get(job);
  if (!waited) return record;
  told(record);
  std::error_code ignored;  // at the next start it goes anyway
  fs::remove_all(folderOf(record), ignored);
  return record;
}

/// The record first: a folder without one is removed at the next start, a record without its result would lie.
void JobRunner::forget(const std::string& job) const {
  std::error_code ignored;
  fs::remove_all(folderOf(registry_.remove(job)), ignored);
}

fs::path JobRunner::resultOf(const std::string& job) const {
  const auto record = registry_.get(job);
  if (record.state != JobState::kSucceeded)
    throw WrongState("job " + job + " is " + nameOf(record.state) + ": only one that has succeeded has a result");
  auto file = folderOf(record) / kResultFile;
  if (!fs::exists(file)) throw WrongState("job " + job + ", of kind " + record.kind + ", has published what it made");
  return file;
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
  return {
      job,
      folderOf(job),
      [this, id](const Progress& progress) { registry_.report(id, progress); },
      std::move(stop),
      [this, id](const std::string& stage) {
        registry_.update(id, [&](JobRecord& record) { record.resumed_from = stage; });
      },
      [this, id] {
        if (registry_.get(id).crashes > 0) registry_.update(id, [](JobRecord& record) { record.crashes = 0; });
      },
      [this, id](const JobResult& result) { registry_.update(id, [&](JobRecord& record) { record.result = result; }); },
      [news = openNews(id)](std::string item) { news->add(std::move(item)); }};
}

std::shared_ptr<JobNews> JobRunner::openNews(const std::string& id) {
  const std::scoped_lock lock(mutex_);
  return news_[id] = std::make_shared<JobNews>();
}

std::shared_ptr<const JobNews> JobRunner::newsOf(const std::string& job) const {
  const std::scoped_lock lock(mutex_);
  const auto found = news_.find(job);
  return found == news_.end() ? nullptr : found->second;
}

/// Records how a run ended, however long that takes on a full disk, and returns the record; nothing when the runner
/// left before: then the next start finds out what became of the job.
std::optional<JobRecord> JobRunner::end(const std::string& id, const std::function<void(JobRecord&)>& change) {
  std::optional<JobRecord> ended;
  for (bool told = false;;) {
    try {
      registry_.update(id, [&](JobRecord& record) {
        change(record);
        ended = record;
      });
      return ended;
    } catch (const std::exception& problem) {
      if (!told) logError("the end of job " + id + " cannot be recorded, trying again: " + problem.what());
      told = true;
    }
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, kRetry, [&] { return leaving_; })) return std::nullopt;
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
    runInBackground(limits_.threads, [&] { result = kind->second.work(run); });
    how_it_ended = [result](JobRecord& record) { markEnded(record, result); };
  } catch (const Stopped&) {
  } catch (...) {
    const auto status = statusOf(std::current_exception(), StopReason::kNone);
    how_it_ended = [status](JobRecord& record) { markFailed(record, status.error_message(), status.error_code()); };
  }
  const auto ended = end(job.id, how_it_ended);
  {
    const std::scoped_lock lock(mutex_);
    stops_.erase(job.id);
    news_.erase(job.id);  // who watches still holds it
  }
  try {
    if (!ended || !hasEnded(ended->state)) return;
    told(*ended);
    tidy(*ended);
    forgetOld();
  } catch (const std::exception& problem) {
    logError("after job " + job.id + ": " + problem.what());
  }
}

}  // namespace shaped::server
