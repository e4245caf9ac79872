#include "core/io/file.h"

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "core/io/file_error.h"
#include "core/numerics/error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

std::size_t entryCount(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("a written file reads back, and can be patched before it is complete") {
  const test::TemporaryFolder folder;
  {
    FileWriter writer(folder / "a");
    writer.write("hello ");
    writer.write("world");
    writer.patch(0, "HE");
    writer.write("!");
    CHECK_FALSE(std::filesystem::exists(folder / "a"));
    writer.commit();
  }
  CHECK(readFile(folder / "a") == "HEllo world!");
  CHECK(entryCount(folder.path()) == 1);
}

TEST_CASE("a symbolic link stays one when its file is written") {
  const test::TemporaryFolder folder;
  folder.file("target", "old");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  writeFile(folder / "link", "new");
  CHECK(std::filesystem::is_symlink(folder / "link"));
  CHECK(readFile(folder / "target") == "new");
}

TEST_CASE("a full disk is a FileError that leaves no trace and the older file as it was") {
  const test::TemporaryFolder folder;
  folder.file("a", "older");
  std::string error;
  {
    const test::FileSizeLimit limit(1000);
    try {
      writeFile(folder / "a", std::string(5000, 'x'));
    } catch (const FileError& thrown) {
      error = thrown.what();
    }
  }
  CHECK_THAT(error, Contains((folder / "a").string() + ": cannot be written: File too large"));
  CHECK(readFile(folder / "a") == "older");
  CHECK(entryCount(folder.path()) == 1);
}

TEST_CASE("a device without space is a FileError") {
  if (!std::filesystem::exists("/dev/full")) return;
  CHECK_THROWS_WITH(writeFile("/dev/full", "x"), Contains("/dev/full: cannot be written: No space left on device"));
  CHECK_NOTHROW(writeFile("/dev/null", "x"));
}

TEST_CASE("what is no readable file is refused by name") {
  const test::TemporaryFolder folder;
  CHECK_THROWS_WITH(readFile(folder / "none"), Contains("none: cannot be opened"));
  CHECK_THROWS_WITH(readFile(folder.path()), Contains("is not a regular file"));
  CHECK_THROWS_WITH(readFile(folder.file("empty", "")), Contains("empty: is empty"));
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK_THROWS_WITH(readFile(folder / "pipe"), Contains("pipe: is not a regular file"));
  CHECK_THROWS_AS(readFile(folder / "none"), InvalidInput);
  CHECK_THROWS_AS(writeFile(folder / "none" / "a", "x"), FileError);
}
