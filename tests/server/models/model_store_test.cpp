#include "server/models/model_store.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

#include "core/io/file_error.h"
#include "server/convert/model.h"
#include "tests/support/models.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;

namespace {

const Provenance provenance{"tubes", std::chrono::system_clock::time_point(std::chrono::seconds(1'700'000'000))};

}  // namespace

TEST_CASE("a published model is served at once, and by the next daemon") {
  const test::TemporaryFolder folder;
  {
    ModelStore store(folder.path());
    CHECK(store.publish("m", test::tubeModel(), provenance)->version == 1);
    CHECK(store.publish("m", test::tubeModel(), provenance)->version == 2);
    CHECK(store.pin("m", 0)->version == 2);
    CHECK(store.pin("m", 1)->shell_pga == test::tubeModel());  // still in memory
  }
  ModelStore store(folder.path());
  const auto model = store.pin("m", 1);
  CHECK(model->shell_pga->topology().id() == test::tubeModel()->topology().id());
  CHECK((model->shell_pga->mean() - test::tubeModel()->mean()).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(provenanceOf(model->manifest).dataset == "tubes");
  CHECK(provenanceOf(model->manifest).created == provenance.created);
  CHECK(store.pin("m", 1) == model);
}

TEST_CASE("what is not there is not found") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  CHECK_THROWS_AS(store.pin("m", 0), ModelNotFound);
  store.publish("m", test::tubeModel(), provenance);
  CHECK_THROWS_AS(store.pin("m", 2), ModelNotFound);
  CHECK_THROWS_AS(store.remove("m", 2), ModelNotFound);
  CHECK_THROWS_AS(store.remove("n", 0), ModelNotFound);
  CHECK_THROWS_AS(store.pin("../m", 0), InvalidInput);
}

TEST_CASE("a pinned model outlives its removal") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  store.publish("m", test::tubeModel(), provenance);
  store.publish("m", test::tubeModel(), provenance);
  const auto pinned = store.pin("m", 1);
  CHECK(store.remove("m", 0) == std::vector<std::uint64_t>{1, 2});
  CHECK(pinned->shell_pga->modes() == 2);
  CHECK_THROWS_AS(store.pin("m", 1), ModelNotFound);
  CHECK(store.list().empty());
}

TEST_CASE("the store keeps only the models used last in memory") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path(), 1);
  std::weak_ptr<const ServedModel> first = store.publish("a", test::tubeModel(), provenance);
  store.publish("b", test::tubeModel(), provenance);
  CHECK(first.expired());
  CHECK(store.pin("a", 0)->name == "a");
}

TEST_CASE("many who want one model wait for one load") {
  const test::TemporaryFolder folder;
  ModelStore(folder.path()).publish("m", test::tubeModel(), provenance);
  ModelStore store(folder.path());
  std::vector<ServedModelPtr> pinned(8);
  {
    std::vector<std::jthread> threads;
    for (auto& model : pinned) threads.emplace_back([&] { model = store.pin("m", 0); });
  }
  for (const auto& model : pinned) CHECK(model == pinned.front());
}

TEST_CASE("a damaged model is reported by name, and the list leaves a damaged manifest out") {
  const test::TemporaryFolder folder;
  {
    ModelStore store(folder.path());
    store.publish("m", test::tubeModel(), provenance);
    store.publish("n", test::tubeModel(), provenance);
  }
  std::ofstream(folder.path() / "m/1/tensors.safetensors", std::ios::app) << "x";
  std::ofstream(folder.path() / "n/1/manifest.json") << "{";
  ModelStore store(folder.path());
  CHECK_THROWS_AS(store.pin("m", 0), FileError);
  REQUIRE(store.list().size() == 1);
  CHECK(store.list().front().name == "m");
}

TEST_CASE("list and description agree") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  const auto model = store.publish("m", test::tubeModel(), provenance);
  v1::ModelDescription listed, described;
  toProto(store.list().front(), listed);
  toProto(*model, described);
  CHECK(described.shell_pga().eigenvalues_size() == 4);
  CHECK(described.training().termination() == v1::TERMINATION_CONVERGED);
  described.mutable_shell_pga()->clear_eigenvalues();
  described.clear_training();
  listed.clear_training();
  CHECK(listed.SerializeAsString() == described.SerializeAsString());
}
