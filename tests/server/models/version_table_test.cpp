#include "server/models/version_table.h"

#include <catch2/catch.hpp>

using namespace shaped;
using namespace shaped::server;

TEST_CASE("a name stands for the newest version, or for the one that is labelled stable") {
  VersionTable table;
  CHECK(table.serving("m") == 0);
  CHECK_FALSE(table.resolve({"m", 0, ""}).has_value());
  table.add({"m", 2});
  table.add({"m", 1});
  CHECK(table.newest("m") == 2);
  CHECK(table.resolve({"m", 0, ""}) == ModelKey{"m", 2});
  table.setLabel("m", "stable", 1);
  table.setLabel("m", "canary", 2);
  CHECK(table.serving("m") == 1);
  CHECK(table.resolve({"m", 0, "canary"}) == ModelKey{"m", 2});
  CHECK(table.resolve({"m", 7, ""}) == ModelKey{"m", 7});
  CHECK(table.labelsOf({"m", 1}) == std::vector<std::string>{"stable"});
  CHECK_THROWS_AS(table.resolve({"m", 0, "old"}), ModelNotFound);
  CHECK_THROWS_AS(table.resolve({"m", 1, "stable"}), InvalidInput);
  table.setLabel("m", "stable", 0);
  CHECK(table.serving("m") == 2);
  CHECK(table.serving("n") == 0);
}

TEST_CASE("a version that has gone hands its name to the one before") {
  VersionTable table;
  table.add({"m", 5});
  table.setLabel("m", "canary", 5);
  table.keepOnly("m", {3, 5, 7});  // 7 is not known yet
  CHECK(table.newest("m") == 5);
  table.keepOnly("m", {3, 4, 7});
  CHECK(table.newest("m") == 4);
  CHECK(table.resolve({"m", 0, "canary"}) == ModelKey{"m", 5});  // to be found missing
  table.keepOnly("m", {7});
  CHECK(table.newest("m") == 0);
  table.add({"m", 7});
  table.keepOnly("m", {});
  CHECK(table.newest("m") == 0);
  CHECK(table.labelsOf({"m", 5}).empty());
  CHECK_THROWS_AS(table.resolve({"m", 0, "canary"}), ModelNotFound);
}
