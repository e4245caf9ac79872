#include "server/jobs/job_runner.h"

#include <algorithm>

#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "server/jobs/arena.h"

namespace shaped::server {
namespace {

void markCancelled(JobRecord& record) {
  record.state = JobState::kCancelled;
  record.ended = std::chrono::system_clock::now();
}

void markEnded(JobRecord& record, const JobResult& result) {
  record.result = result;
  record.ended = std::chrono::system_clock::now();
  if (result.outcome.termination == Termination::kCancelled) {
    record.state = JobState::kCancelled;
  } else if (result.model_version == 0) {
    record.state = JobState::kFailed;
    record.error = "the training did not converge (" + std::string(name(result.outcome.termination)) +
                   "), so no model was published; ask for it with publish_unconverged, or allow more iterations";
    record.error_code = grpc::FAILED_PRECONDITION;
  } else {
    record.state = JobState::kSucceeded;
    record.fraction = 1;
  }
}

void markFailed(JobRecord& record, const grpc::Status& status) {
  record.state = JobState::kFailed;
  record.ended = std::chrono::system_clock::now();
  record.error = status.error_message();
  record.error_code = status.error_code();
}

std::uint64_t numberOf(const std::string& id) { return std::stoull(id); }

}  // namespace

JobRunner::JobRunner(JobRegistry& registry, const JobLimits& limits)
    : registry_(registry),
      limits_(limits),
      pool_(limits.running, {.queue_length = limits.waiting, .queue_bytes = 1, .open_streams = 1}, {}) {}

JobRunner::~JobRunner() { cancelAll(); }

JobRecord JobRunner::start(const std::string& model_name, const std::string& dataset, Work work) {
  JobRecord request;
  request.model_name = model_name;
  request.dataset = dataset;
  const auto record = registry_.create(request);
  std::stop_token stop;
  {
    const std::scoped_lock lock(mutex_);
    stop = stops_[record.id].get_token();
  }
  const auto decision = pool_.submit(numberOf(record.id), 0, Entry::kCall,
                                     [this, id = record.id, work = std::move(work), stop] { run(id, work, stop); });
  if (decision.admitted) return record;
  forget(record.id);
  registry_.update(record.id, [&](JobRecord& refused) {
    markFailed(refused, {grpc::RESOURCE_EXHAUSTED, "too many jobs are waiting"});
  });
  throw Busy("too many jobs are waiting; watch one end, or cancel one, and try again");
}

JobRecord JobRunner::cancel(const std::string& job) {
  const auto id = registry_.get(job).id;
  if (pool_.withdraw(numberOf(id))) {
    forget(id);
    registry_.update(id, markCancelled);
  } else {
    const std::scoped_lock lock(mutex_);
    if (const auto found = stops_.find(id); found != stops_.end()) found->second.request_stop();
  }
  return registry_.get(id);
}

void JobRunner::cancelAll() {
  const std::scoped_lock lock(mutex_);
  for (auto& [id, stop] : stops_) {
    if (pool_.withdraw(numberOf(id))) registry_.update(id, markCancelled);
    stop.request_stop();
  }
}

void JobRunner::run(const std::string& id, const Work& work, std::stop_token stop) {
  registry_.update(id, [](JobRecord& record) {
    record.state = JobState::kRunning;
    record.started = std::chrono::system_clock::now();
  });
  const ProgressSink progress = [this, &id](const Progress& now) {
    registry_.update(id, [&](JobRecord& record) {
      record.stage = now.stage;
      record.fraction = std::max(record.fraction, now.fraction);
      record.residual = now.residual;
    });
  };
  try {
    JobResult result;
    runInArena(limits_.threads, [&] { result = work(progress, stop); });
    registry_.update(id, [&](JobRecord& record) { markEnded(record, result); });
  } catch (const Stopped&) {
    registry_.update(id, markCancelled);
  } catch (...) {
    const auto status = statusOf(std::current_exception(), StopReason::kNone);
    registry_.update(id, [&](JobRecord& record) { markFailed(record, status); });
  }
  forget(id);
}

void JobRunner::forget(const std::string& id) {
  const std::scoped_lock lock(mutex_);
  stops_.erase(id);
}

}  // namespace shaped::server
