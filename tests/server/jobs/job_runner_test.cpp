#include "server/jobs/job_runner.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <future>
#include <memory>
#include <set>

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
  std::string request;
  bool has_folder = false;
  // On the job's thread, where nothing can be checked: Catch knows one thread. Looked at once that has ended.
  std::vector<double> fractions;
  auto runner = std::make_unique<JobRunner>(registry, kindsOf([&](const JobRun& run) {
                                              request = run.job.request;
                                              has_folder = std::filesystem::is_directory(run.folder);
                                              go.get_future().wait();
                                              run.progress({"mean", 0.5, 0.1});
                                              run.progress({"modes", 0.4, 0.2});
                                              return published();
                                            }),
                                            JobLimits{}, at.jobs);
  const auto record = runner->start(wanted());
  CHECK(record.model_name == "m");
  waitForStart(registry, record.id);
  const auto listener = registry.listen(record.id, [&] { fractions.push_back(registry.get(record.id).fraction); });
  go.set_value();
  const auto ended = waitForEnd(registry, record.id);
  runner.reset();
  CHECK(request == "what to do");
  CHECK(has_folder);
  CHECK(ended.state == JobState::kSucceeded);
  CHECK(ended.stage == "modes");
  CHECK(ended.fraction == 1);
  CHECK(ended.attempts == 1);
  CHECK(ended.result->model_version == 1);
  CHECK(ended.started.has_value());
  CHECK(ended.ended.has_value());
  CHECK(fractions.size() >= 3);  // two reports and the end
  CHECK(std::is_sorted(fractions.begin(), fractions.end()));
}

TEST_CASE("what a job tells is there while it runs, and for whoever holds it") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  std::promise<void> told, heard;
  JobRunner runner(registry, kindsOf([&](const JobRun& run) {
                     for (const auto* item : {"one", "two", "three"}) run.tell(item);
                     told.set_value();
                     heard.get_future().wait();
                     return published();
                   }),
                   {}, at.jobs);
  const auto id = runner.start(wanted()).id;
  told.get_future().wait();
  const auto news = runner.newsOf(id);
  REQUIRE(news);
  CHECK(runner.newsOf("no such job") == nullptr);
  CHECK(news->from(0, 2) == std::vector<std::string>{"one", "two"});
  CHECK(news->from(2, 2) == std::vector<std::string>{"three"});
  CHECK(news->from(3, 2).empty());
  heard.set_value();
  waitForEnd(registry, id);
  CHECK(news->from(0, 9).size() == 3);
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
  SqliteJobRegistry registry(at.file);
  CHECK(std::filesystem::exists(at.jobs / registry.get(running).key / "checkpoint"));
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
  SqliteJobRegistry registry(at.file);
  const auto key = registry.get(id).key;
  for (const auto& name : {key, std::string("99"), std::string("rubbish")})
    std::filesystem::create_directories(at.jobs / name);
  writeFile(at.jobs / key / "checkpoint", "x");
  writeFile(at.jobs / key / "checkpoint.partial-1-2", "x");
  JobRunner runner(registry, kindsOf(untilStopped), {}, at.jobs);
  CHECK(std::filesystem::exists(at.jobs / key / "checkpoint"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / key / "checkpoint.partial-1-2"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / "99"));
  CHECK_FALSE(std::filesystem::exists(at.jobs / "rubbish"));
}

namespace {

/// Leaves a result of so many bytes, and what else a kind keeps.
Work leaving(std::size_t bytes) {
  return [bytes](const JobRun& run) {
    writeFile(run.folder / "checkpoint", "x");
    writeFile(run.folder / kResultFile, std::string(bytes, 'r'));
    return JobResult{{}, 0, {Termination::kConverged, 3, 1e-9}, 0.1, 0.5, {}};
  };
}

std::set<std::string> namesIn(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

/// Until the runner has tidied up behind the job.
void waitForNames(const std::filesystem::path& folder, const std::set<std::string>& names) {
  const auto until = std::chrono::steady_clock::now() + 20s;
  while (namesIn(folder) != names && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(1ms);
  CHECK(namesIn(folder) == names);
}

}  // namespace

TEST_CASE("a result is kept with its job, over a restart too, and goes with it") {
  const Setting at;
  std::string id, key;
  {
    SqliteJobRegistry registry(at.file);
    JobRunner runner(registry, kindsOf(leaving(9)), {}, at.jobs);
    id = runner.start(wanted()).id;
    key = waitForEnd(registry, id).key;
    waitForNames(at.jobs / key, {kResultFile});
    CHECK(runner.resultOf(id) == at.jobs / key / kResultFile);
  }
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf(untilStopped), {}, at.jobs);
  CHECK(readFile(runner.resultOf(id)) == "rrrrrrrrr");
  const auto running = waitForStart(registry, runner.start(wanted()).id);
  CHECK_THROWS_WITH(runner.resultOf(running.id), Catch::Contains("is running"));
  CHECK_THROWS_AS(runner.forget(running.id), WrongState);
  runner.forget(id);
  CHECK_FALSE(std::filesystem::exists(at.jobs / key));
  CHECK_THROWS_AS(runner.resultOf(id), NotFound);
}

TEST_CASE("a job that failed or published keeps no result") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, kindsOf([](const JobRun& run) -> JobResult {
                     if (run.job.model_name == "m") return published();
                     writeFile(run.folder / kResultFile, "x");
                     throw InvalidInput("frames[3]", "is bad");
                   }),
                   {}, at.jobs);
  const auto training = waitForEnd(registry, runner.start(wanted()).id);
  CHECK_THROWS_WITH(runner.resultOf(training.id), Catch::Contains("published"));
  const auto failed = waitForEnd(registry, runner.start(wanted("n")).id);
  CHECK_THROWS_AS(runner.resultOf(failed.id), WrongState);
  waitForNames(at.jobs, {});
}

TEST_CASE("results that are too large together are forgotten from the oldest on, but for the latest") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobLimits limits;
  limits.retention.result_bytes = 250;
  std::vector<std::string> ids;
  {
    JobRunner runner(registry, kindsOf(leaving(100)), limits, at.jobs);
    for (int i = 0; i < 3; ++i) ids.push_back(runner.start(wanted()).id);
    for (const auto& id : ids)
      if (id != ids[0]) waitForEnd(registry, id);
  }
  CHECK_THROWS_AS(registry.get(ids[0]), NotFound);
  CHECK(registry.get(ids[1]).state == JobState::kSucceeded);
  CHECK(namesIn(at.jobs).size() == 2);
  limits.retention.result_bytes = 1;
  JobRunner runner(registry, kindsOf(leaving(100)), limits, at.jobs);
  CHECK_THROWS_AS(registry.get(ids[1]), NotFound);
  CHECK_NOTHROW(runner.resultOf(ids[2]));
}

TEST_CASE("what a client sent is the job's, once, however often it starts it") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  std::atomic<bool> missing{false};
  JobRunner runner(registry, kindsOf([&](const JobRun& run) {
                     if (!std::filesystem::exists(run.folder / kInputFile)) missing = true;
                     return untilStopped(run);
                   }),
                   {}, at.jobs);
  auto job = wanted();
  job.request_id = "r";
  std::string key;
  for (int i = 0; i < 2; ++i) {
    const auto input = runner.newInput();
    input->append("frame");
    const auto started = runner.start(job, input.get());
    if (i == 0) key = started.key;
    CHECK(started.key == key);
    CHECK((input->key() == key) == (i == 0));
  }
  CHECK(namesIn(at.jobs) == std::set<std::string>{key});
  const auto id = registry.find("r")->id;
  runner.cancel(id);
  waitForEnd(registry, id);
  waitForNames(at.jobs, {});
  CHECK_FALSE(missing);
}

TEST_CASE("whoever asked hears of every end, once") {
  const Setting at;
  const auto crashed = crashedJob(at.file, 2);
  SqliteJobRegistry registry(at.file);
  std::mutex mutex;
  std::vector<std::pair<std::string, JobState>> ends;
  JobRunner runner(
      registry, kindsOf([](const JobRun& run) { return run.job.model_name == "m" ? published() : untilStopped(run); }),
      {}, at.jobs, [&](const JobRecord& job) {
        const std::scoped_lock lock(mutex);
        ends.emplace_back(job.id, job.state);
      });
  const auto done = runner.start(wanted()).id;
  waitForEnd(registry, done);
  const auto running = waitForStart(registry, runner.start(wanted("n")).id).id;
  const auto waiting = runner.start(wanted("n")).id;
  runner.cancel(waiting);
  runner.cancel(waiting);
  runner.cancel(running);
  waitForEnd(registry, running);
  const std::vector<std::pair<std::string, JobState>> expected{{crashed, JobState::kFailed},
                                                               {done, JobState::kSucceeded},
                                                               {waiting, JobState::kCancelled},
                                                               {running, JobState::kCancelled}};
  const auto until = std::chrono::steady_clock::now() + 20s;
  const auto heard = [&] {
    const std::scoped_lock lock(mutex);
    return ends;
  };
  while (heard().size() < expected.size() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(1ms);
  CHECK(heard() == expected);
}

TEST_CASE("a job of a kind that this daemon does not know has failed") {
  const Setting at;
  SqliteJobRegistry registry(at.file);
  JobRunner runner(registry, {}, {}, at.jobs);
  CHECK_THAT(waitForEnd(registry, runner.start(wanted()).id).error, Catch::Contains("kind \"k\""));
}
