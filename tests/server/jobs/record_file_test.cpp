#include "server/jobs/record_file.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "server/errors/errors.h"
#include "server/errors/status.h"
#include "server/jobs/job_input.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;

namespace {

std::vector<std::string> recordsOf(const std::filesystem::path& path) {
  RecordReader reader(path);
  std::vector<std::string> records;
  for (std::string record; reader.next(record);) records.push_back(record);
  return records;
}

const std::vector<std::string> kRecords{"first", "", std::string("a\0b", 3), std::string(100'000, 'x')};

std::filesystem::path written(const test::TemporaryFolder& folder) {
  RecordWriter writer(folder / "r", 0);
  for (const auto& record : kRecords) writer.append(record);
  writer.sync();
  CHECK(writer.count() == 4);
  return folder / "r";
}

}  // namespace

TEST_CASE("records come back as they were written, and more may follow") {
  const test::TemporaryFolder folder;
  const auto path = written(folder);
  CHECK(recordsOf(path) == kRecords);
  RecordWriter(path, RecordWriter::kAll).append("fifth");
  CHECK(recordsOf(path).size() == 5);
  RecordWriter(path, 2).append("third");
  CHECK(recordsOf(path) == std::vector<std::string>{"first", "", "third"});
  CHECK_THROWS_AS(RecordWriter(path, 4), Corrupted);
  CHECK(recordsOf(path).size() == 3);
  CHECK_THROWS_AS(RecordReader(folder / "none"), FileError);
}

TEST_CASE("a record that was torn anywhere is not read, and cut off by the next writer") {
  const test::TemporaryFolder folder;
  const auto bytes = test::bytesOf(written(folder));
  const auto third_end = bytes.size() - 100'000 - 24;
  for (const auto cut : {third_end + 1, third_end + 23, third_end + 24, bytes.size() - 1}) {
    INFO(cut);
    const auto torn = folder.file("torn", bytes.substr(0, cut));
    CHECK_THROWS_AS(recordsOf(torn), Corrupted);
    CHECK(RecordWriter(torn, RecordWriter::kAll).count() == 3);
    CHECK(recordsOf(torn).size() == 3);
  }
  for (const auto at : {third_end, third_end + 9, bytes.size() - 5}) {  // length, checksum, content
    INFO(at);
    auto damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    CHECK_THROWS_AS(recordsOf(folder.file("damaged", damaged)), Corrupted);
  }
}

TEST_CASE("a full disk leaves the records that were there, and the next one fits again") {
  const test::TemporaryFolder folder;
  RecordWriter writer(folder / "r", 0);
  writer.append("first");
  {
    const test::FileSizeLimit limit(1000);
    std::string told;
    try {
      writer.append(std::string(5000, 'x'));
    } catch (const FileError& error) {
      told = error.what();
    }
    CHECK(saysDiskFull(told));
    CHECK(recordsOf(folder / "r") == std::vector<std::string>{"first"});
  }
  writer.append("second");
  CHECK(recordsOf(folder / "r").size() == 2);
}

TEST_CASE("what is sent for a job leaves nothing unless the job is started") {
  const test::TemporaryFolder folder;
  std::string hash;
  {
    JobInput input(folder.path(), "key");
    input.append("a");
    input.append("bc");
    CHECK(recordsOf(folder / "key/input").size() == 2);
    hash = input.hash();
  }
  CHECK(std::filesystem::is_empty(folder.path()));
  JobInput other(folder.path(), "other");
  other.append("ab");
  other.append("c");
  CHECK(other.hash() != hash);
}
