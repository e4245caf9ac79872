#include "server/jobs/job_runner.h"

#include <catch2/catch.hpp>
#include <condition_variable>
#include <future>

#include "core/io/file.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"
#include "server/jobs/sqlite_job_registry.h"
#include "server/telemetry/call_log.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using namespace std::chrono_literals;

namespace {

using Work = std::function<JobResult(const JobRun&)>;

JobResult published() { return {"m", 1, {Termination::kConverged, 3, 1e-9}, 0.1, 0.5, {}}; }

/// Works until it is asked to stop.
JobResult untilStopped(const JobRun& run) {
  std::promise<void> stopped;
  const std::stop_callback on_stop(run.stop, [&] { stopped.set_value(); });
  stopped.get_future().wait();
  return {"m", 0, {Termination::kCancelled, 1, 1}, 0.1, 0, {}};
}

JobRunner::Kinds kindsOf(Work work, std::uint64_t version = 0) {
  return {{"k", {std::move(work), [version](const JobRecord&) { return version; }}}};
}

JobRecord wanted(const std::string& model = "m") {
  JobRecord record;
  record.kind = "k";
  record.request = "what to do";
  record.model_name = model;
  record.dataset = "d";
  return record;
}

JobRecord waitFor(JobRegistry& registry, const std::string& id, const std::function<bool(JobState)>& reached) {
  const auto until = std::chrono::steady_clock::now() + 20s;
  while (!reached(registry.get(id).state) && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(1ms);
  return registry.get(id);
}

JobRecord waitForEnd(JobRegistry& registry, const std::string& id) { return waitFor(registry, id, hasEnded); }

JobRecord waitForStart(JobRegistry& registry, const std::string& id) {
  return waitFor(registry, id, [](JobState state) { return state == JobState::kRunning; });
}

/// A job that a process left running when it died.
std::string crashedJob(const std::filesystem::path& file, int crashes = 0) {
  SqliteJobRegistry registry(file);
  const auto id = registry.create(wanted(), 10).id;
  registry.claim();
  registry.update(id, [&](JobRecord& record) { record.crashes = crashes; });
  return id;
}

struct Setting {
  Setting() { startLog("error"); }
  test::TemporaryFolder folder;
  std::filesystem::path file = folder / "jobs.sqlite", jobs = folder / "jobs";
};

}  // namespace

TEST_CASE("a job runs, reports progress that never falls, and ends with its result") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  std::promise<void> go;
  JobRunner runner(registry, kindsOf([&](const JobRun& run) {
                     CHECK(run.job.request == "what to do");
                     CHECK(std::filesystem::is_directory(run.folder));
                     go.get_future().wait();
                     run.progress({"mean", 0.5, 0.1});
                     run.progress({"modes", 0.4, 0.2});
                     return published();
                   }),
                   {}, at.jobs);
  const auto record = runner.start(wanted());
  CHECK(record.model_name == "m");
  std::vector<double> fractions;
  const auto listener = registry.listen(record.id, [&] { fractions.push_back(registry.get(record.id).fraction); });
  waitForStart(registry, record.id);
  go.set_value();
  const auto ended = waitForEnd(registry, record.id);
  CHECK(ended.state == JobState::kSucceeded);
  CHECK(ended.stage == "modes");
  CHECK(ended.fraction == 1);
  CHECK(ended.attempts == 1);
  CHECK(ended.result->model_version == 1);
  CHECK(ended.started.has_value());
  CHECK(ended.ended.has_value());
  CHECK(std::is_sorted(fractions.begin(), fractions.end()));
}

TEST_CASE("a job's folder goes when it has ended") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  {
    JobRunner runner(registry, kindsOf([](const JobRun& run) {
                       writeFile(run.folder / "checkpoint", "x");
                       return published();
                     }),
                     {}, at.jobs);
    waitForEnd(registry, runner.start(wanted()).id);
  }
  CHECK(std::filesystem::is_empty(at.jobs));
}

TEST_CASE("a job that throws has failed, with the status of what it threw") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry,
                   kindsOf([](const JobRun&) -> JobResult { throw InvalidInput("shapes[2]", "is like shapes[1]"); }),
                   {}, at.jobs);
  const auto ended = waitForEnd(registry, runner.start(wanted()).id);
  CHECK(ended.state == JobState::kFailed);
  CHECK(ended.error == "shapes[2]: is like shapes[1]");
  CHECK(ended.error_code == 3);
}

TEST_CASE("a result that says why it is a failure makes one, with its report") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf([](const JobRun&) -> JobResult {
                     return {"m", 0, {Termination::kIterationLimit, 100, 1e-3}, 1, 0.4, "did not converge"};
                   }),
                   {}, at.jobs);
  const auto ended = waitForEnd(registry, runner.start(wanted()).id);
  CHECK(ended.state == JobState::kFailed);
  CHECK(ended.result->outcome.iterations == 100);
  CHECK(ended.error == "did not converge");
}

TEST_CASE("cancelling ends a running job soon and a waiting one at once") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf(untilStopped),
                   {.running = 1, .waiting = 1, .threads = 1, .crashes = 3, .retention = {}}, at.jobs);
  const auto running = runner.start(wanted());
  waitForStart(registry, running.id);
  const auto waiting = runner.start(wanted("n"));
  CHECK_THROWS_AS(runner.start(wanted("o")), Busy);
  CHECK(runner.cancel(waiting.id).state == JobState::kCancelled);
  CHECK(runner.cancel(running.id).cancel_requested);
  CHECK(waitForEnd(registry, running.id).state == JobState::kCancelled);
  CHECK(runner.cancel(running.id).state == JobState::kCancelled);
  CHECK_THROWS_AS(runner.cancel("99"), NotFound);
  CHECK_THROWS_AS(runner.cancel("x"), NotFound);
}

TEST_CASE("a runner that leaves queues its jobs again, and the next one does them") {
  const Setting at;
  std::string running, waiting;
  {
    SqliteJobRegistry registry(at.file);
    JobRunner runner(registry, kindsOf([](const JobRun& run) {
                       writeFile(run.folder / "checkpoint", "x");
                       return untilStopped(run);
                     }),
                     {}, at.jobs);
    running = runner.start(wanted()).id;
    waiting = runner.start(wanted("n")).id;
    waitForStart(registry, running);
  }
  CHECK(std::filesystem::exists(at.jobs / running / "checkpoint"));
  SqliteJobRegistry registry(at.file);
  CHECK(registry.get(running).state == JobState::kQueued);
  CHECK(registry.get(running).crashes == 0);
  JobRunner runner(registry, kindsOf([](const JobRun&) { return published(); }), {}, at.jobs);
  CHECK(waitForEnd(registry, running).attempts == 2);
  CHECK(waitForEnd(registry, waiting).attempts == 1);
}

TEST_CASE("a job that a dead process left running goes on, until it has crashed too often") {
  const Setting at;
  const auto id = crashedJob(at.file);
  const auto hopeless = crashedJob(at.file, 2);
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf([](const JobRun& run) {
                     run.checkpointed();
                     return published();
                   }),
                   {}, at.jobs);
  const auto ended = waitForEnd(registry, id);
  CHECK(ended.state == JobState::kSucceeded);
  CHECK(ended.attempts == 2);
  CHECK(ended.crashes == 0);
  CHECK(registry.get(hopeless).state == JobState::kFailed);
  CHECK_THAT(registry.get(hopeless).error, Catch::Contains("died 3 times"));
}

TEST_CASE("a job that had published when its process died has succeeded, and is not done again") {
  const Setting at;
  const auto id = crashedJob(at.file, 2);
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf([](const JobRun&) -> JobResult { throw std::logic_error("done twice"); }, 7), {},
                   at.jobs);
  CHECK(registry.get(id).state == JobState::kSucceeded);
  CHECK(registry.get(id).result->model_version == 7);
}

TEST_CASE("a job that was being cancelled when its process died is cancelled") {
  const Setting at;
  const auto id = crashedJob(at.file);
  {
    SqliteJobRegistry registry(at.file);
    registry.update(id, [](JobRecord& record) { record.cancel_requested = true; });
  }
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf([](const JobRun&) { return published(); }), {}, at.jobs);
  CHECK(registry.get(id).state == JobState::kCancelled);
}

TEST_CASE("folders of no job that goes on, and half-written files, are removed at the start") {
  const Setting at;
  const auto id = crashedJob(at.file);
  for (const auto& name : {id, std::string("99"), std::string("rubbish")})
    std::filesystem::create_directories(at.jobs / name);
  writeFile(at.jobs / id / "checkpoint", "x");
  writeFile(at.jobs / id / "checkpoint.partial-1-2", "x");
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf(untilStopped), {}, at.jobs);
  CHECK(std::filesystem::exists(at.jobs / id / "checkpoint"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / id / "checkpoint.partial-1-2"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / "99"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / "rubbish"));
}

TEST_CASE("a job of a kind that this daemon does not know has failed") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, {}, {}, at.jobs);
  CHECK_THAT(waitForEnd(registry, runner.start(wanted()).id).error, Catch::Contains("kind \"k\""));
}
