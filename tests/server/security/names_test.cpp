// No path from a client is ever used as a path: every text of a request that could reach the file system is a model's
// or a dataset's name, and passes a check on its way.
#include <catch2/catch.hpp>
#include <fstream>

#include "core/io/model_directory.h"
#include "core/numerics/error.h"
#include "server/datasets/dataset_store.h"
#include "server/errors/errors.h"
#include "server/jobs/sqlite_job_registry.h"
#include "server/models/model_store.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;

namespace {

const std::vector<std::string> kHostile{"",
                                        ".",
                                        "..",
                                        "../x",
                                        "../victim",
                                        "a/b",
                                        "/etc/passwd",
                                        "a/../../victim",
                                        "\\..\\x",
                                        ".hidden",
                                        ".lock",
                                        ".scratch-0",
                                        std::string("a\0b", 3),
                                        std::string("\0", 1),
                                        "a\n",
                                        "a b",
                                        "a%2fb",
                                        "~",
                                        "\xc3\xa9t\xc3\xa9",
                                        std::string(101, 'a'),
                                        std::string(1 << 20, 'a')};

/// A store with a neighbour that nothing may touch.
struct Fixture {
  Fixture() {
    std::filesystem::create_directories(folder / "victim" / "1");
    std::ofstream(folder / "victim" / "1" / "manifest.json") << "secret";
  }
  ~Fixture() { CHECK(std::filesystem::exists(folder / "victim" / "1" / "manifest.json")); }

  /// What lies beside store and victim.
  std::size_t entries() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder / "."), std::filesystem::directory_iterator()));
  }

  test::TemporaryFolder folder;
};

}  // namespace

TEST_CASE("hostile names of models reach no file") {
  const Fixture fixture;
  ModelStore store(fixture.folder / "models");
  const auto before = fixture.entries();
  for (const auto& name : kHostile)
    for (const std::uint64_t version : {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0}}) {
      CHECK_THROWS_AS(store.pin({name, version, ""}), InvalidInput);
      CHECK_THROWS_AS(store.remove(name, version), InvalidInput);
    }
  const ModelDirectory directory(fixture.folder / "models");
  ModelManifest manifest;
  manifest.kind = "k";
  for (const auto& name : kHostile) CHECK_THROWS_AS(directory.publish(name, manifest, {}), InvalidInput);
  CHECK(fixture.entries() == before);
}

TEST_CASE("hostile names of datasets reach no file") {
  const Fixture fixture;
  DatasetStore store(fixture.folder / "datasets");
  const auto before = fixture.entries();
  const auto sphere = test::icosphere(0);
  for (const auto& name : kHostile) {
    CHECK_THROWS_AS(store.begin(name, sphere.topology->vertexCount(), sphere.topology->faces(), 1), InvalidInput);
    // Not in the index, so the name never becomes a path.
    CHECK_THROWS_AS(store.load(name), NotFound);
    CHECK_THROWS_AS(store.remove(name), NotFound);
  }
  CHECK(fixture.entries() == before);
  CHECK(std::filesystem::is_empty(fixture.folder / "datasets"));
}

TEST_CASE("a job id from a client is looked up, never made a path") {
  const test::TemporaryFolder folder;
  const SqliteJobRegistry registry(folder / "jobs.sqlite");
  for (const auto& name : kHostile) CHECK_THROWS_AS(registry.get(name), NotFound);
}
