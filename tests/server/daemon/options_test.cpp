#include "server/daemon/options.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "server/daemon/store_lock.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

TEST_CASE("the daemon's options are read") {
  const auto options =
      parseOptions({"--listen", "[::1]:7", "--store=dir", "--threads", "3", "--queue-megabytes", "2"}, 8);
  REQUIRE(options.has_value());
  CHECK(options->listen == "[::1]:7");
  CHECK(options->store == "dir");
  CHECK(options->threads == 3);
  CHECK(options->limits.queue_bytes == 2 << 20);
  CHECK(parseOptions({"--store", "dir"}, 8)->threads == 8);
  CHECK_FALSE(parseOptions({"--help"}, 8).has_value());
}

TEST_CASE("faulty options are refused by name") {
  CHECK_THROWS_WITH(parseOptions({}, 1), Contains("--store: is missing"));
  CHECK_THROWS_WITH(parseOptions({"--store"}, 1), Contains("--store: wants a value"));
  CHECK_THROWS_WITH(parseOptions({"--stroe", "x"}, 1), Contains("--stroe: is no option"));
  CHECK_THROWS_WITH(parseOptions({"--store", "x", "--threads", "0"}, 1), Contains("--threads: \"0\""));
  CHECK_THROWS_WITH(parseOptions({"--store", "x", "--threads", "2x"}, 1), Contains("--threads: \"2x\""));
  CHECK_THROWS_WITH(parseOptions({"--store", "x", "--longest-call", "nan"}, 1), Contains("--longest-call: \"nan\""));
}

TEST_CASE("a store serves one daemon at a time") {
  const test::TemporaryFolder folder;
  {
    const StoreLock lock(folder / "store");
    CHECK_THROWS_WITH(StoreLock(folder / "store"), Contains("--store:") && Contains("another daemon"));
  }
  CHECK_NOTHROW(StoreLock(folder / "store"));
}
