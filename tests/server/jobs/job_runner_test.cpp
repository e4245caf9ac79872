#include "server/jobs/job_runner.h"

#include <catch2/catch.hpp>
#include <condition_variable>
#include <future>

#include "core/numerics/error.h"
#include "server/errors/errors.h"

using namespace shaped;
using namespace shaped::server;

namespace {

JobResult published() { return {"m", 1, {Termination::kConverged, 3, 1e-9}, 0.1, 0.5}; }

/// Works until it is asked to stop.
JobResult untilStopped(const ProgressSink&, std::stop_token stop) {
  std::promise<void> stopped;
  const std::stop_callback on_stop(stop, [&] { stopped.set_value(); });
  stopped.get_future().wait();
  return {"m", 0, {Termination::kCancelled, 1, 1}, 0.1, 0};
}

JobRecord waitForEnd(JobRegistry& registry, const std::string& id) {
  std::mutex mutex;
  std::condition_variable changed;
  const auto listener = registry.listen(id, [&] {
    const std::scoped_lock lock(mutex);
    changed.notify_all();
  });
  std::unique_lock lock(mutex);
  changed.wait_for(lock, std::chrono::seconds(20), [&] { return hasEnded(registry.get(id).state); });
  return registry.get(id);
}

}  // namespace

TEST_CASE("a job runs, reports progress that never falls, and ends with its result") {
  MemoryJobRegistry registry;
  JobRunner runner(registry, {});
  std::promise<void> go;
  const auto record = runner.start("m", "d", [&](const ProgressSink& progress, std::stop_token) {
    go.get_future().wait();
    progress({"mean", 0.5, 0.1});
    progress({"modes", 0.4, 0.2});
    return published();
  });
  CHECK(record.model_name == "m");
  std::vector<double> fractions;
  const auto listener = registry.listen(record.id, [&] { fractions.push_back(registry.get(record.id).fraction); });
  go.set_value();
  const auto ended = waitForEnd(registry, record.id);
  CHECK(ended.state == JobState::kSucceeded);
  CHECK(ended.stage == "modes");
  CHECK(ended.fraction == 1);
  CHECK(ended.result->model_version == 1);
  CHECK(ended.started.has_value());
  CHECK(ended.ended.has_value());
  CHECK(std::is_sorted(fractions.begin(), fractions.end()));
}

TEST_CASE("a job that throws has failed, with the status of what it threw") {
  MemoryJobRegistry registry;
  JobRunner runner(registry, {});
  const auto bad = runner.start("m", "d", [](const ProgressSink&, std::stop_token) -> JobResult {
    throw InvalidInput("shapes[2]", "is like shapes[1]");
  });
  const auto ended = waitForEnd(registry, bad.id);
  CHECK(ended.state == JobState::kFailed);
  CHECK(ended.error == "shapes[2]: is like shapes[1]");
  CHECK(ended.error_code == 3);
}

TEST_CASE("a job that did not converge and published nothing has failed and says why") {
  MemoryJobRegistry registry;
  JobRunner runner(registry, {});
  const auto job = runner.start("m", "d", [](const ProgressSink&, std::stop_token) -> JobResult {
    return {"m", 0, {Termination::kIterationLimit, 100, 1e-3}, 1, 0.4};
  });
  const auto ended = waitForEnd(registry, job.id);
  CHECK(ended.state == JobState::kFailed);
  CHECK(ended.result->outcome.iterations == 100);
  CHECK(ended.error.find("iteration_limit") != std::string::npos);
}

TEST_CASE("cancelling ends a running job soon and a waiting one at once") {
  MemoryJobRegistry registry;
  JobRunner runner(registry, {.running = 1, .waiting = 1, .threads = 1});
  const auto running = runner.start("m", "d", untilStopped);
  while (registry.get(running.id).state != JobState::kRunning) std::this_thread::yield();
  const auto waiting = runner.start("n", "d", [](const ProgressSink&, std::stop_token) { return published(); });
  CHECK_THROWS_AS(runner.start("o", "d", untilStopped), Busy);
  CHECK(runner.cancel(waiting.id).state == JobState::kCancelled);
  runner.cancel(running.id);
  CHECK(waitForEnd(registry, running.id).state == JobState::kCancelled);
  CHECK(runner.cancel(running.id).state == JobState::kCancelled);
  CHECK_THROWS_AS(runner.cancel("99"), NotFound);
  CHECK_THROWS_AS(runner.cancel("x"), NotFound);
}

TEST_CASE("destroying the runner cancels what is left") {
  MemoryJobRegistry registry;
  std::string running, waiting;
  {
    JobRunner runner(registry, {});
    running = runner.start("m", "d", untilStopped).id;
    waiting = runner.start("n", "d", untilStopped).id;
  }
  CHECK(registry.get(running).state == JobState::kCancelled);
  CHECK(registry.get(waiting).state == JobState::kCancelled);
}

TEST_CASE("the registry forgets the oldest ended jobs only") {
  MemoryJobRegistry registry(2);
  const auto kept = registry.create({}).id;
  std::vector<std::string> ended;
  for (int i = 0; i < 3; ++i) ended.push_back(registry.create({}).id);
  for (const auto& id : ended) registry.update(id, [](JobRecord& record) { record.state = JobState::kSucceeded; });
  CHECK(registry.list().size() == 3);
  CHECK_NOTHROW(registry.get(kept));
  CHECK_THROWS_AS(registry.get(ended[0]), NotFound);
  CHECK_FALSE(registry.update(ended[2], [](JobRecord& record) { record.stage = "late"; }));
  CHECK(registry.get(ended[2]).stage.empty());
}
