#include "server/rpc/job_context.h"

#include <condition_variable>
#include <mutex>

#include "core/io/file_error.h"
#include "core/io/sha256.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {
namespace {

using Clock = std::chrono::steady_clock;

/// False when the token fired first.
bool sleepUnlessStopped(Clock::duration time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  return !wake.wait_for(lock, stop, time, [] { return false; }) && !stop.stop_requested();
}

/// Set from any thread, perhaps after nobody waits any more.
struct Bell {
  std::mutex mutex;
  std::condition_variable_any wake;
  bool rung = false;

  void ring() {
    const std::scoped_lock lock(mutex);
    rung = true;
    wake.notify_all();
  }
  void wait(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    if (!wake.wait(lock, stop, [this] { return rung; })) throw Stopped();
  }
};

}  // namespace

void patiently(const JobContext& context, const JobRun& run, const std::function<void()>& write) {
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(context.publish_patience);
  while (true) try {
      return write();
    } catch (const FileError& error) {
      if (!saysDiskFull(error.what()) || Clock::now() >= until) throw;
      run.progress({std::string("waiting for room on the disk: ") + error.what(), 0, 0});
      if (!sleepUnlessStopped(std::chrono::seconds(2), run.stop)) throw Stopped();
    }
}

ServedModelPtr pinForJob(const JobContext& context, const JobRun& run, const v1::ModelSelector& model) {
  while (true) try {
      return context.models.pin(selectorFromProto(model));
    } catch (const Waiting& waiting) {
      const auto bell = std::make_shared<Bell>();
      waiting.then([bell] { bell->ring(); });
      bell->wait(run.stop);
    }
}

void nameVersion(const ServedModel& served, v1::ModelSelector& model) {
  model.set_name(served.name);
  model.set_version(served.version);
  model.clear_label();
}

void repeatVersion(const v1::ModelSelector& known, v1::ModelSelector& model) {
  if (known.name() == model.name() && model.version() == 0) model = known;
}

std::string textOf(const v1::ModelSelector& model) { return model.name() + "@" + std::to_string(model.version()); }

void requireConnectivity(const ServedModel& model, const DatasetInfo& dataset) {
  if (dataset.topology_id != model.shapes->topology().id())
    throw InvalidInput("dataset", "\"" + dataset.name + "\" has another connectivity than the model");
}

std::string fingerprintOf(const Dataset& dataset) {
  Sha256 hash;
  hash.update(dataset.topology->id());
  for (const auto& shape : dataset.shapes)
    hash.update(
        {reinterpret_cast<const char*>(shape.data()), static_cast<std::size_t>(shape.size()) * sizeof(double)});
  return hash.finish();
}

JobRecord newJob(const std::string& kind, std::string request, const std::string& request_id) {
  JobRecord job;
  job.kind = kind;
  job.request = std::move(request);
  job.request_id = request_id;
  return job;
}

std::optional<JobRecord> earlierJob(const JobDesk& desk, const std::string& request_id) {
  if (request_id.empty()) return std::nullopt;
  requireName(request_id, "request_id");
  return desk.registry.find(request_id);
}

void throwUnreadable(const JobRecord& job) { throw Corrupted("the request of job " + job.id + " cannot be read"); }

}  // namespace shaped::server
