#include "server/jobs/sqlite_job_registry.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

constexpr std::size_t kMany = 1000;

JobRecord wanted(const std::string& request_id = "") {
  JobRecord record;
  record.kind = "k";
  record.request = std::string("a\0b", 3);
  record.request_id = request_id;
  record.model_name = "m";
  return record;
}

void succeed(JobRecord& record) {
  record.state = JobState::kSucceeded;
  record.ended = std::chrono::system_clock::now();
}

}  // namespace

TEST_CASE("a record comes back from its file as it was") {
  const test::TemporaryFolder folder;
  std::string id, key;
  {
    SqliteJobRegistry registry(folder / "jobs.sqlite");
    const auto made = registry.create(wanted("r"), kMany);
    id = made.id, key = made.key;
    registry.update(id, [](JobRecord& record) {
      record.result = {"m", 3, {Termination::kStalled, 12, INFINITY}, 1.5, 0.25, {}};
      record.stage = "modes";
      record.resumed_from = "mean";
      record.error = "e", record.error_code = 9;
      record.crashes = 2;
      record.cancel_requested = true;
      record.residual = NAN;
      succeed(record);
    });
  }
  const auto record = SqliteJobRegistry(folder / "jobs.sqlite").get(id);
  CHECK(key.size() == 32);
  CHECK(record.key == key);
  CHECK(record.request == std::string("a\0b", 3));
  CHECK(record.request_id == "r");
  CHECK(record.state == JobState::kSucceeded);
  CHECK(record.cancel_requested);
  CHECK(record.stage == "modes");
  CHECK(record.resumed_from == "mean");
  CHECK(record.crashes == 2);
  CHECK(record.error_code == 9);
  CHECK(record.residual == 0);
  REQUIRE(record.result);
  CHECK(record.result->model_version == 3);
  CHECK(record.result->model_name == "m");
  CHECK(record.result->outcome.termination == Termination::kStalled);
  CHECK(std::isinf(record.result->outcome.residual));
  CHECK(record.result->smallest_area_ratio == 0.25);
  CHECK(record.ended.has_value());
  CHECK_FALSE(record.started.has_value());
}

TEST_CASE("ids are not used again, neither after a deletion nor after a restart") {
  const test::TemporaryFolder folder;
  std::string last;
  for (int i = 0; i < 3; ++i) {
    SqliteJobRegistry registry(folder / "jobs.sqlite");
    const auto id = registry.create(wanted(), kMany).id;
    CHECK(id != last);
    last = id;
    CHECK_THROWS_AS(registry.remove(id), WrongState);
    registry.update(id, succeed);
    registry.remove(id);
    CHECK_THROWS_AS(registry.get(id), NotFound);
    CHECK_THROWS_AS(registry.remove(id), NotFound);
  }
}

TEST_CASE("a request_id makes one job, however often it comes, and refuses another request") {
  SqliteJobRegistry registry(":memory:");
  const auto first = registry.create(wanted("r"), 1);
  CHECK(registry.create(wanted("r"), 1).id == first.id);  // although one waits already
  auto other = wanted("r");
  other.request = "else";
  CHECK_THROWS_AS(registry.create(other, kMany), AlreadyExists);
  CHECK_THROWS_AS(registry.create(wanted("s"), 1), Busy);
  CHECK(registry.find("r")->id == first.id);
  CHECK_FALSE(registry.find("s"));
}

TEST_CASE("jobs are listed oldest first, page by page and by state") {
  SqliteJobRegistry registry(":memory:");
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(registry.create(wanted(), kMany).id);
  registry.update(ids[1], succeed);
  const auto page = registry.list({{}, ids[1], 2});
  REQUIRE(page.size() == 2);
  CHECK(page[0].id == ids[2]);
  CHECK(page[1].id == ids[3]);
  CHECK(registry.list({{JobState::kSucceeded}, {}, 10}).size() == 1);
  CHECK(registry.list({{JobState::kSucceeded, JobState::kQueued}, {}, 10}).size() == 5);
  CHECK_THROWS_AS(registry.list({{}, "x", 2}), InvalidInput);
}

TEST_CASE("jobs are claimed once each, in order, and those of a dead process are taken over") {
  const test::TemporaryFolder folder;
  std::string first, second;
  {
    SqliteJobRegistry registry(folder / "jobs.sqlite");
    first = registry.create(wanted(), kMany).id;
    second = registry.create(wanted(), kMany).id;
    CHECK(registry.claim()->id == first);
    CHECK(registry.claim()->id == second);
    CHECK_FALSE(registry.claim());
    CHECK(registry.takeOver().empty());
    registry.update(second, [](JobRecord& record) { record.state = JobState::kQueued; });
  }
  SqliteJobRegistry registry(folder / "jobs.sqlite");
  const auto taken = registry.takeOver();
  REQUIRE(taken.size() == 1);
  CHECK(taken[0].id == first);
  CHECK(taken[0].crashes == 1);
  CHECK(registry.claim()->id == second);
  CHECK(registry.takeOver().empty());
}

TEST_CASE("progress is live at once, and durable now and then") {
  const test::TemporaryFolder folder;
  const auto file = folder / "jobs.sqlite";
  SqliteJobRegistry registry(file, std::chrono::hours(1));
  const auto id = registry.create(wanted(), kMany).id;
  int told = 0;
  const auto listener = registry.listen(id, [&] { ++told; });
  registry.report(id, {"mean", 0.5, 0.1});
  CHECK(told == 1);
  CHECK(registry.get(id).fraction == 0.5);
  CHECK(registry.list({})[0].stage == "mean");
  CHECK(SqliteJobRegistry(file).get(id).stage.empty());
  registry.update(id, [](JobRecord&) {});
  CHECK(SqliteJobRegistry(file).get(id).stage == "mean");
  SqliteJobRegistry eager(file, {});
  eager.report(id, {"modes", 0.6, 0});
  CHECK(SqliteJobRegistry(file).get(id).stage == "modes");
}

TEST_CASE("the oldest ended jobs are forgotten, by count and by age") {
  SqliteJobRegistry registry(":memory:");
  const auto kept = registry.create(wanted(), kMany).id;
  std::vector<std::string> ended;
  for (int i = 0; i < 4; ++i) ended.push_back(registry.create(wanted(), kMany).id);
  for (const auto& id : ended) registry.update(id, succeed);
  const auto forgotten = registry.forgetOld({3, std::chrono::hours(0)});
  REQUIRE(forgotten.size() == 1);
  CHECK(forgotten[0].id == ended[0]);
  CHECK_THROWS_AS(registry.get(ended[0]), NotFound);
  CHECK(registry.list({}).size() == 4);
  CHECK_FALSE(registry.update(ended[2], [](JobRecord& record) { record.stage = "late"; }));
  CHECK(registry.get(ended[2]).stage.empty());
  const auto aged = registry.create(wanted(), kMany).id;
  registry.update(aged, [](JobRecord& record) {
    succeed(record);
    *record.ended -= std::chrono::hours(50);
  });
  registry.forgetOld({100, std::chrono::hours(49)});
  CHECK_THROWS_AS(registry.get(aged), NotFound);
  CHECK_NOTHROW(registry.get(ended[3]));
  CHECK_NOTHROW(registry.get(kept));
}

TEST_CASE("a damaged database is refused with its name and what to do, one of a later version too") {
  const test::TemporaryFolder folder;
  const auto rubbish = folder.file("rubbish.sqlite", std::string(5000, 'x'));
  CHECK_THROWS_AS(SqliteJobRegistry(rubbish), Corrupted);
  CHECK_THROWS_WITH(SqliteJobRegistry(rubbish), Contains("rubbish.sqlite") && Contains("move it away"));
  const auto file = folder / "jobs.sqlite";
  {
    SqliteJobRegistry registry(file);
    for (int i = 0; i < 200; ++i) registry.create(wanted(), kMany);
  }
  auto bytes = test::bytesOf(file);
  for (std::size_t i = 4096; i < bytes.size(); ++i) bytes[i] = 'x';
  CHECK_THROWS_AS(SqliteJobRegistry(folder.file("torn.sqlite", bytes)), Corrupted);
  Database(file).run("PRAGMA user_version = 2");
  CHECK_THROWS_WITH(SqliteJobRegistry(file), Contains("schema version 2"));
}

TEST_CASE("a database that another program keeps locked says so, and nothing is changed") {
  const test::TemporaryFolder folder;
  SqliteJobRegistry registry(folder / "jobs.sqlite");
  {
    Database other(folder / "jobs.sqlite");
    const Transaction lock(other);
    CHECK_THROWS_AS(registry.create(wanted(), kMany), StoreLocked);  // after ten seconds
  }
  CHECK(registry.list({}).empty());
  CHECK_NOTHROW(registry.create(wanted(), kMany));
}

TEST_CASE("a record keeps the key that it was given") {
  SqliteJobRegistry registry(":memory:");
  auto record = wanted();
  record.key = newJobKey();
  CHECK(registry.create(record, kMany).key == record.key);
  CHECK(newJobKey() != record.key);
}

TEST_CASE("a folder that is not there says so") {
  CHECK_THROWS_WITH(SqliteJobRegistry("/nowhere/jobs.sqlite"), Contains("/nowhere/jobs.sqlite"));
}

TEST_CASE("a full disk refuses a change, keeps what was, and the next change succeeds") {
  const test::TemporaryFolder folder;
  SqliteJobRegistry registry(folder / "jobs.sqlite", {});
  const auto id = registry.create(wanted(), kMany).id;
  const auto grow = [](JobRecord& record) { record.request = std::string(1 << 20, 'x'); };
  {
    const test::FileSizeLimit limit(100'000);
    std::string told;
    try {
      registry.update(id, grow);
    } catch (const FileError& error) {
      told = error.what();
    }
    INFO(told);
    CHECK(saysDiskFull(told));
    CHECK_THAT(told, Contains("jobs.sqlite"));
    CHECK(registry.get(id).request.size() == 3);
    // What fits is still written, although the journal may not grow for ever.
    for (int i = 0; i < 100; ++i)
      registry.update(id, [i](JobRecord& record) { record.stage = "stage " + std::to_string(i); });
    registry.report(id, {"mean", 0.5, 0});
  }
  CHECK(registry.update(id, grow));
  CHECK(SqliteJobRegistry(folder / "jobs.sqlite").get(id).stage == "mean");
}

TEST_CASE("many threads may change, report, list and listen at once") {
  const test::TemporaryFolder folder;
  SqliteJobRegistry registry(folder / "jobs.sqlite", {});
  std::atomic<int> told{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) {
        const auto id = registry.create(wanted(), kMany).id;
        const auto listener = registry.listen(id, [&, id] {
          registry.get(id);
          ++told;
        });
        registry.claim();
        registry.report(id, {"mean", 0.5, 0.1});
        registry.list({});
        registry.update(id, succeed);
      }
    });
  for (auto& thread : threads) thread.join();
  CHECK(told >= 80);
  CHECK(registry.list({{JobState::kSucceeded}, {}, kMany}).size() == 40);
}
