#include "server/daemon/options.h"

#include <catch2/catch.hpp>

#include "core/io/file.h"
#include "core/numerics/error.h"
#include "server/daemon/command_line.h"
#include "server/daemon/config_file.h"
#include "server/daemon/preload.h"
#include "server/daemon/store_lock.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

DaemonOptions parse(const std::vector<std::string>& words) { return parseCommandLine(words, 8).options; }

/// A configuration file of this text, read.
std::vector<GivenOption> read(const std::string& text) {
  const test::TemporaryFolder folder;
  writeFile(folder / "shaped.yaml", text);
  return readConfigFile(folder / "shaped.yaml");
}

}  // namespace

TEST_CASE("the daemon's options are read") {
  const auto options = parse({"--listen", "[::1]:7", "--store=dir", "--threads", "3", "--in-flight-megabytes", "2"});
  CHECK(options.listen == "[::1]:7");
  CHECK(options.store == "dir");
  CHECK(options.threads == 3);
  CHECK(options.admission.bytes_in_flight == 2 << 20);
  CHECK(parse({"--store", "dir"}).threads == 8);
}

TEST_CASE("a command line asks to serve, to check, for help or for the version") {
  using Action = CommandLine::Action;
  CHECK(parseCommandLine({"--store", "dir"}, 1).action == Action::kServe);
  CHECK(parseCommandLine({"--check", "--store", "dir"}, 1).action == Action::kCheck);
  CHECK(parseCommandLine({"--help", "--nonsense"}, 1).action == Action::kHelp);
  CHECK(parseCommandLine({"--version"}, 1).action == Action::kVersion);
}

TEST_CASE("faulty options are refused by name") {
  CHECK_THROWS_WITH(parse({}), Contains("--store: is missing"));
  CHECK_THROWS_WITH(parse({"--store"}), Contains("--store: wants a value"));
  CHECK_THROWS_WITH(parse({"--stroe", "x"}), Contains("--stroe: is no option"));
  CHECK_THROWS_WITH(parse({"store", "x"}), Contains("store: is no option"));
  CHECK_THROWS_WITH(parse({"--store", "x", "--threads", "0"}), Contains("--threads: \"0\""));
  CHECK_THROWS_WITH(parse({"--store", "x", "--threads", "2x"}), Contains("--threads: \"2x\""));
  CHECK_THROWS_WITH(parse({"--store", "x", "--longest-call", "nan"}), Contains("--longest-call: \"nan\""));
  CHECK_THROWS_WITH(parse({"--store", "x", "--log", "loud"}), Contains("--log: \"loud\" is no level"));
}

TEST_CASE("every option shows its value as it would be given") {
  DaemonOptions options;
  options.store = "somewhere";
  for (const auto& spec : optionSpecs()) {
    const auto value = spec.show(options);
    CAPTURE(spec.name, value);
    DaemonOptions copy;
    spec.set(copy, spec.name, value);
    CHECK(spec.show(copy) == value);
    CHECK(usage().find("--" + spec.name + " ") != std::string::npos);
  }
}

TEST_CASE("a configuration file without a name is refused") {
  CHECK_THROWS_WITH(parse({"--config="}), Contains("--config: wants a file"));
}

TEST_CASE("models to preload are named with version or label, and the policy by its name") {
  CHECK(parse({"--store", "s"}).preload.empty());
  CHECK(parse({"--store", "s", "--preload", "all"}).preload == "all");
  CHECK(preloadListFrom("", "all").all);
  CHECK(preloadListFrom("", "").models.empty());
  const auto list = preloadListFrom("--preload", "a,b@3,c@canary");
  REQUIRE(list.models.size() == 3);
  CHECK_FALSE(list.all);
  CHECK((list.models[0].name == "a" && list.models[0].version == 0 && list.models[0].label.empty()));
  CHECK((list.models[1].name == "b" && list.models[1].version == 3 && list.models[1].label.empty()));
  CHECK((list.models[2].name == "c" && list.models[2].version == 0 && list.models[2].label == "canary"));
  for (const auto* text : {",", "a,,b", "a,", "../a", "a@", "a@0", "a@-1", "a@b/c", "a b"})
    CHECK_THROWS_WITH(parse({"--store", "s", "--preload", text}), Contains("--preload: "));
  CHECK_FALSE(parse({"--store", "s", "--model-policy", "explicit"}).watch_models);
  CHECK(parse({"--store", "s", "--model-policy", "watch"}).watch_models);
  CHECK_THROWS_WITH(parse({"--store", "s", "--model-policy", "poll"}),
                    Contains("--model-policy: \"poll\", want explicit or"));
}

TEST_CASE("the command line overrides the configuration file") {
  const test::TemporaryFolder folder;
  writeFile(folder / "shaped.yaml", "store: /srv\nthreads: 5\ndrain: 2.5\n");
  const auto config = (folder / "shaped.yaml").string();
  const auto options = parse({"--threads", "7", "--config", config});
  CHECK(options.store == "/srv");
  CHECK(options.threads == 7);
  CHECK(options.drain == 2.5);
}

TEST_CASE("the example configuration names every option with its default") {
  const std::filesystem::path file = std::filesystem::path(SHAPED_SOURCE) / "deploy" / "shaped.yaml";
  const auto given = readConfigFile(file);
  DaemonOptions options;
  setOptions(given, options);
  const DaemonOptions defaults;
  const auto text = readFile(file);
  for (const auto& spec : optionSpecs()) {
    CAPTURE(spec.name);
    CHECK(text.find(spec.name + ":") != std::string::npos);
    if (spec.name != "store") CHECK(spec.show(options) == spec.show(defaults));
  }
}

TEST_CASE("configuration files are refused with file and line") {
  CHECK_THROWS_WITH(read(""), Contains("shaped.yaml: is empty"));
  CHECK(read("# nothing\n").empty());
  CHECK(read("list: [a, b]\n").front().value == "a,b");
  CHECK_THROWS_WITH(read("store: x\nthreads: 1\nstore: y\n"), Contains("shaped.yaml:3: store: stands there twice"));
  CHECK_THROWS_WITH(read("store: x\n  bad: [1\n"), Contains("shaped.yaml:2") && Contains("is no YAML"));
  CHECK_THROWS_WITH(read("- store\n"), Contains("want one mapping"));
  CHECK_THROWS_WITH(read("threads: {a: 1}\n"), Contains("shaped.yaml:1: threads: wants a value"));
  CHECK_THROWS_WITH(read("threads: ~\n"), Contains("threads: wants a value"));
  CHECK_THROWS_WITH(readConfigFile("/nowhere/shaped.yaml"), Contains("/nowhere/shaped.yaml"));
  DaemonOptions options;
  CHECK_THROWS_WITH(setOptions(read("store: x\nthraeds: 3\n"), options),
                    Contains("shaped.yaml:2: thraeds: is no option of shaped"));
  CHECK_THROWS_WITH(setOptions(read("threads: many\n"), options), Contains("shaped.yaml:1: threads: \"many\""));
}

TEST_CASE("a store serves one daemon at a time") {
  const test::TemporaryFolder folder;
  {
    const StoreLock lock(folder / "store");
    CHECK_THROWS_WITH(StoreLock(folder / "store"), Contains("--store:") && Contains("another daemon"));
  }
  CHECK_NOTHROW(StoreLock(folder / "store"));
}
