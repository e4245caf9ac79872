#include "server/models/model_store.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <future>
#include <thread>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/sha256.h"
#include "core/model/body_shapes.h"
#include "core/model/shell_pga_shapes.h"
#include "server/convert/model.h"
#include "server/errors/errors.h"
#include "server/models/kind.h"
#include "tests/support/bodies.h"
#include "tests/support/models.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;

namespace {

const Provenance provenance{
    "tubes", std::chrono::system_clock::time_point(std::chrono::seconds(1'700'000'000)), {}, {}};

/// Pins on a thread that may wait.
ServedModelPtr pinNow(ModelStore& store, const ModelSelector& selector) {
  while (true) try {
      return store.pin(selector);
    } catch (const Waiting& waiting) {
      std::promise<void> came;
      waiting.then([&came] { came.set_value(); });
      came.get_future().wait();
    }
}

const ShapeModelPtr& tubes() {
  static const ShapeModelPtr model = std::make_shared<const ShellPgaShapes>(test::tubeModel());
  return model;
}

/// A body model of bars with two joints more than its root.
ShapeModelPtr bars() {
  return std::make_shared<const BodyShapes>(
      test::tubeModel(3, 6, 3),
      BodyTrainingRecord{6, PostureNormalisation::kLocal, 0.1, Eigen::VectorXd::LinSpaced(5, 0.5, 0.1), 2.5});
}

/// A folder with this many versions of "m".
void publishVersions(const std::filesystem::path& folder, int count) {
  ModelStore store(folder);
  for (int i = 0; i < count; ++i) store.publish("m", tubes(), provenance);
}

}  // namespace

TEST_CASE("a published model is served at once, and by the next daemon") {
  const test::TemporaryFolder folder;
  {
    ModelStore store(folder.path());
    CHECK(store.publish("m", tubes(), provenance)->version == 1);
    CHECK(store.publish("m", tubes(), provenance)->version == 2);
    CHECK(store.pin({"m", 0, ""})->version == 2);
    CHECK(store.pin({"m", 0, ""})->shapes == tubes());  // still in memory
  }
  ModelStore store(folder.path());
  const auto model = pinNow(store, {"m", 1, ""});
  CHECK(model->shapes->topology().id() == test::tubeModel()->topology().id());
  CHECK((model->shapes->mean() - test::tubeModel()->mean()).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(provenanceOf(model->manifest).dataset == "tubes");
  CHECK(provenanceOf(model->manifest).created == provenance.created);
  CHECK(pinNow(store, {"m", 1, ""}) == model);
}

TEST_CASE("a version tells the job that made it") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  store.publish("m", tubes(), provenance);
  CHECK(store.publishedBy("m", "abc") == 0);
  CHECK(store.publishedBy("nobody", "abc") == 0);
  store.publish("m", tubes(), {"tubes", provenance.created, "7", "abc"});
  CHECK(store.publishedBy("m", "abc") == 2);
  CHECK(store.publishedBy("m", "abd") == 0);
  CHECK(provenanceOf(pinNow(store, {"m", 2, ""})->manifest).job == "7");
}

TEST_CASE("a store says what it has in memory") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  CHECK(store.loaded().empty());
  const auto model = pinNow(store, {"m", 0, ""});
  REQUIRE(store.loaded() == std::vector{model});
  CHECK(model->bytes > model->manifest.tensors_bytes / 2);
  CHECK(model->bytes < 20 * model->manifest.tensors_bytes);
  store.remove("m", 0);
  CHECK(store.loaded().empty());
}

TEST_CASE("what is not there is not found") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  CHECK_THROWS_AS(pinNow(store, {"m", 0, ""}), ModelNotFound);
  store.publish("m", tubes(), provenance);
  CHECK_THROWS_AS(pinNow(store, {"m", 2, ""}), ModelNotFound);
  CHECK_THROWS_AS(store.remove("m", 2), ModelNotFound);
  CHECK_THROWS_AS(store.remove("n", 0), ModelNotFound);
  CHECK_THROWS_AS(pinNow(store, {"../m", 0, ""}), InvalidInput);
}

TEST_CASE("a pinned model outlives its removal") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  store.publish("m", tubes(), provenance);
  store.publish("m", tubes(), provenance);
  const auto pinned = pinNow(store, {"m", 1, ""});
  CHECK(store.remove("m", 0) == std::vector<std::uint64_t>{1, 2});
  CHECK(pinned->shapes->modes() == 2);
  CHECK_THROWS_AS(pinNow(store, {"m", 1, ""}), ModelNotFound);
  CHECK(store.list().empty());
}

TEST_CASE("many who want one model wait for one load") {
  const test::TemporaryFolder folder;
  ModelStore(folder.path()).publish("m", tubes(), provenance);
  ModelStore store(folder.path());
  std::vector<ServedModelPtr> pinned(8);
  {
    std::vector<std::jthread> threads;
    for (auto& model : pinned) threads.emplace_back([&] { model = pinNow(store, {"m", 0, ""}); });
  }
  for (const auto& model : pinned) CHECK(model == pinned.front());
}

TEST_CASE("a damaged model is reported by name, and the list leaves a damaged manifest out") {
  const test::TemporaryFolder folder;
  {
    ModelStore store(folder.path());
    store.publish("m", tubes(), provenance);
    store.publish("n", tubes(), provenance);
  }
  std::ofstream(folder.path() / "m/1/tensors.safetensors", std::ios::app) << "x";
  std::ofstream(folder.path() / "n/1/manifest.json") << "{";
  ModelStore store(folder.path());
  CHECK_THROWS_AS(pinNow(store, {"m", 0, ""}), FileError);
  REQUIRE(store.list().size() == 1);
  CHECK(store.list().front().name == "m");
}

TEST_CASE("a manifest with fields of other types is listed with what it does say") {
  ModelStore::Entry entry{"m", 1, {}, ModelState::kStored, 0, {}};
  entry.manifest.kind = GENERATE("shell_pga", "body", "other");
  entry.manifest.description = {{"vertices", "many"}, {"faces", 80},
                                {"modes", -1},        {"bending", nlohmann::json::array()},
                                {"topology", 7},      {"provenance", {{"dataset", 3}, {"created", 9e18}}}};
  v1::ModelDescription description;
  toProto(entry, description);
  CHECK(description.kind() == entry.manifest.kind);
  CHECK(description.vertex_count() == 0);
  CHECK(description.face_count() == 80);
  CHECK(description.shell_pga().modes() == 0);
  CHECK(description.body().modes() == 0);
  CHECK(description.topology_id().empty());
  CHECK(description.dataset().empty());
  CHECK_FALSE(description.has_created());
}

TEST_CASE("list and description agree") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  const auto model = store.publish("m", tubes(), provenance);
  v1::ModelDescription listed, described;
  toProto(store.list().front(), listed);
  toProto(*model, described);
  toProto(store.standing("m", 1), described);
  CHECK(described.shell_pga().eigenvalues_size() == 4);
  CHECK(described.training().termination() == v1::TERMINATION_CONVERGED);
  described.mutable_shell_pga()->clear_eigenvalues();
  described.clear_training();
  listed.clear_training();
  CHECK(listed.SerializeAsString() == described.SerializeAsString());
}

TEST_CASE("a model of another kind is published, listed, described, dropped and loaded like any other") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  const auto model = store.publish("b", bars(), provenance);
  store.publish("m", tubes(), provenance);
  v1::ModelDescription listed, described;
  toProto(store.list().front(), listed);
  toProto(*model, described);
  for (const auto& description : {listed, described}) {
    CHECK(description.kind() == "body");
    CHECK_FALSE(description.has_shell_pga());
    CHECK(description.body().modes() == 3);
    CHECK(description.body().training_shapes() == 6);
    CHECK(description.vertex_count() == static_cast<std::uint32_t>(model->shapes->topology().vertexCount()));
    CHECK(description.topology_id() == model->shapes->topology().id());
    CHECK(description.memory_bytes() == model->bytes);
  }
  CHECK(described.body().posture() == v1::POSTURE_NORMALISATION_LOCAL);
  CHECK(described.body().variances_size() == 5);
  REQUIRE(described.body().joints_size() > 2);
  CHECK(described.body().joints(0).parent() == -1);
  CHECK(described.training().seconds() == 2.5);
  CHECK(bodyFor("a test", *model).modes() == 3);
  CHECK_THROWS_WITH(shellPgaFor("Shapes.Edit", *model),
                    "model b version 1 is of kind \"body\", and Shapes.Edit needs one of kind \"shell_pga\"");
  CHECK_THROWS_AS(bodyFor("a test", *store.pin({"m", 0, ""})), WrongState);
  CHECK(store.unload("b", 0) == std::vector<std::uint64_t>{1});
  CHECK(pinNow(store, {"b", 0, ""})->shapes->mean() == model->shapes->mean());
}

TEST_CASE("a model that is not in memory is waited for without a thread") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  CHECK(store.list().front().state == ModelState::kStored);
  CHECK_THROWS_AS(store.pin({"m", 0, ""}), Waiting);
  CHECK(pinNow(store, {"m", 0, ""})->version == 1);
  CHECK(store.list().front().state == ModelState::kReady);
  CHECK(store.loaded().size() == 1);
}

TEST_CASE("a broken model fails each time alike, until its files change") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  const auto tensors = folder.path() / "m/1/tensors.safetensors";
  const auto good = readFile(tensors);
  std::ofstream(tensors, std::ios::app) << "x";
  ModelStore store(folder.path());
  std::string first;
  for (int attempt = 0; attempt < 3; ++attempt) try {
      pinNow(store, {"m", 0, ""});
      FAIL("it must not load");
    } catch (const FileError& error) {
      if (first.empty()) first = error.what();
      CHECK(error.what() == first);
    }
  CHECK(store.list().front().state == ModelState::kFailed);
  CHECK_THROWS_AS(store.pin({"m", 0, ""}), FileError);  // at once
  writeFile(tensors, good);
  CHECK(pinNow(store, {"m", 0, ""})->version == 1);
}

TEST_CASE("what another process puts into the store counts once it is loaded") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  const auto before = pinNow(store, {"m", 0, ""});
  std::filesystem::copy(folder.path() / "m/1", folder.path() / "m/2", std::filesystem::copy_options::recursive);
  CHECK(store.pin({"m", 0, ""}) == before);
  CHECK(store.load("m", 0)->wait()->version == 2);
  CHECK(store.pin({"m", 0, ""})->version == 2);
  CHECK(before->shapes->modes() == 2);               // who holds it keeps it
  CHECK(store.loaded().size() == 1);                 // the store does not
  CHECK(pinNow(store, {"m", 1, ""})->version == 1);  // by number it can still be had
  CHECK(store.pin({"m", 0, ""})->version == 2);
}

TEST_CASE("a load that fails leaves the version before") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  const auto before = pinNow(store, {"m", 0, ""});
  std::filesystem::copy(folder.path() / "m/1", folder.path() / "m/2", std::filesystem::copy_options::recursive);
  std::ofstream(folder.path() / "m/2/tensors.safetensors", std::ios::app) << "x";
  CHECK_THROWS_AS(store.load("m", 0)->wait(), FileError);
  CHECK(store.pin({"m", 0, ""}) == before);
}

TEST_CASE("loading again replaces the model in memory") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  const auto before = pinNow(store, {"m", 0, ""});
  const auto after = store.load("m", 0)->wait();
  CHECK(after != before);
  CHECK(store.pin({"m", 0, ""}) == after);
}

TEST_CASE("labels stand for versions, for good") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 3);
  {
    ModelStore store(folder.path());
    store.setLabel("m", "stable", 2);
    store.setLabel("m", "canary", 3);
    CHECK_THROWS_AS(store.setLabel("m", "canary", 4), ModelNotFound);
    CHECK_THROWS_AS(store.setLabel("m", "../x", 1), InvalidInput);
    CHECK_THROWS_AS(store.setLabel("n", "stable", 1), ModelNotFound);
  }
  ModelStore store(folder.path());
  CHECK(pinNow(store, {"m", 0, ""})->version == 2);
  CHECK(pinNow(store, {"m", 0, "canary"})->version == 3);
  CHECK_THROWS_AS(store.pin({"m", 0, "old"}), ModelNotFound);
  CHECK_THROWS_AS(store.pin({"m", 1, "stable"}), InvalidInput);
  CHECK_THROWS_AS(store.remove("m", 2), WrongState);
  CHECK(store.remove("m", 1) == std::vector<std::uint64_t>{1});
  store.setLabel("m", "stable", 0);
  CHECK(pinNow(store, {"m", 0, ""})->version == 3);
  CHECK(store.remove("m", 2) == std::vector<std::uint64_t>{2});
  CHECK(store.remove("m", 0) == std::vector<std::uint64_t>{3});
  CHECK_THROWS_AS(store.pin({"m", 0, "canary"}), ModelNotFound);
}

TEST_CASE("the memory budget drops what was used longest ago, and never what a request holds") {
  const test::TemporaryFolder folder;
  const auto bytes = test::tubeModel()->bytes();
  ModelStore store(folder.path(), {.memory_budget = 2 * bytes + bytes / 2, .loaders = 1});
  for (const auto* name : {"a", "b", "c"}) store.publish(name, tubes(), provenance);
  REQUIRE(store.loaded().size() == 2);
  CHECK(store.loaded()[0]->name == "b");
  const auto held = store.pin({"b", 0, ""});
  const auto also = pinNow(store, {"a", 0, ""});  // c goes
  CHECK(store.loaded()[0]->name == "a");
  CHECK(store.loaded()[1]->name == "b");
  CHECK_THROWS_AS(pinNow(store, {"c", 0, ""}), OverBudget);
}

TEST_CASE("a model larger than the whole budget is published, but not served") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path(), {.memory_budget = 1000, .loaders = 1});
  CHECK(store.publish("m", tubes(), provenance)->version == 1);
  CHECK(store.loaded().empty());
  try {
    pinNow(store, {"m", 0, ""});
    FAIL("it must not load");
  } catch (const OverBudget& error) {
    CHECK_FALSE(error.mayPass());
  }
}

TEST_CASE("what is unloaded is loaded again when wanted") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 2);
  ModelStore store(folder.path());
  for (const std::uint64_t version : {1, 2}) pinNow(store, {"m", version, ""});
  CHECK(store.unload("m", 1) == std::vector<std::uint64_t>{1});
  CHECK(store.unload("m", 0) == std::vector<std::uint64_t>{2});
  CHECK(store.unload("m", 0).empty());
  CHECK_THROWS_AS(store.unload("n", 0), ModelNotFound);
  CHECK(pinNow(store, {"m", 0, ""})->version == 2);
}

TEST_CASE("one can wait for a model that is still to come") {
  const test::TemporaryFolder folder;
  ModelStore store(folder.path());
  int woken = 0;
  try {
    store.ready({"m", 0, ""});
    FAIL("it is not there");
  } catch (const Waiting& waiting) {
    waiting.then([&] { ++woken; });
  }
  CHECK(woken == 0);
  store.publish("m", tubes(), provenance);
  CHECK(woken == 1);
  CHECK(store.ready({"m", 0, ""})->version == 1);
}

namespace {

/// The files of version 1 of "m", sent as "n" in pieces of `piece` bytes; `change` may spoil a piece.
std::unique_ptr<IncomingModel> sent(ModelStore& store, std::size_t piece = 1000, std::size_t spoiled = SIZE_MAX) {
  const auto files = store.files({"m", 1, ""});
  auto incoming = store.receive("n", files.manifest_text);
  for (std::size_t i = 0; i < files.tensors->bytes().size(); i += piece) {
    std::string bytes(files.tensors->bytes().substr(i, piece));
    if (i <= spoiled && spoiled < i + piece) bytes[spoiled - i] ^= 1;
    incoming->append(bytes);
  }
  return incoming;
}

std::vector<std::string> entriesOf(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST_CASE("a model that is brought is published once it has been verified, to the bit") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  auto incoming = sent(store);
  CHECK(store.list().size() == 1);
  const auto served = store.publish(std::move(incoming), {})->wait();
  CHECK(served->name == "n");
  CHECK(served->version == 1);
  CHECK(store.pin({"n", 0, ""}) == served);
  for (const auto* file : {kManifestFile, kTensorsFile})
    CHECK(readFile(folder.path() / "n/1" / file) == readFile(folder.path() / "m/1" / file));
  CHECK(store.publish(sent(store), {})->wait()->version == 2);
  CHECK(store.pin({"n", 0, ""})->version == 2);
  CHECK(entriesOf(folder.path()) == std::vector<std::string>{"m", "n"});
}

TEST_CASE("nothing is left of a model that cannot be taken in") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  CHECK_THROWS_WITH(store.publish(sent(store, 1000, 2500), {})->wait(), Catch::Contains("tensors: have SHA-256"));
  CHECK(entriesOf(folder.path()) == std::vector<std::string>{"m"});

  std::stop_source stopped;
  stopped.request_stop();
  CHECK_THROWS_AS(store.publish(sent(store), stopped.get_token())->wait(), Stopped);
  sent(store);  // and given up
  CHECK(entriesOf(folder.path()) == std::vector<std::string>{"m"});

  CHECK_THROWS_WITH(store.receive("../n", store.files({"m", 1, ""}).manifest_text), Catch::Contains("no name"));
  CHECK_THROWS_AS(store.receive("n", "{}"), InvalidInput);
  auto manifest = store.files({"m", 1, ""}).manifest;
  manifest.kind = "oracle";
  CHECK_THROWS_WITH(store.receive("n", textOf(manifest)), Catch::Contains("is of kind \"oracle\""));
  CHECK(entriesOf(folder.path()) == std::vector<std::string>{"m"});
}

TEST_CASE("a model that is larger than the budget is not taken in") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  const auto manifest = ModelStore(folder.path()).files({"m", 1, ""}).manifest_text;
  ModelStore store(folder.path(), {.memory_budget = 1000, .loaders = 1});
  CHECK_THROWS_AS(store.receive("n", manifest), OverBudget);
}

TEST_CASE("a label's version is handed on, whatever becomes of it meanwhile") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 2);
  ModelStore store(folder.path());
  store.setLabel("m", "stable", 1);
  const auto files = store.files({"m", 0, ""});
  CHECK(files.version == 1);
  CHECK(store.files({"m", 2, ""}).version == 2);
  CHECK_THROWS_AS(store.files({"m", 3, ""}), ModelNotFound);
  const auto before = sha256(files.tensors->bytes());
  store.remove("m", 0);
  CHECK(sha256(files.tensors->bytes()) == before);
  CHECK(before == files.manifest.tensors_sha256);
}

TEST_CASE("a look takes over what another process changed in the store") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 2);
  ModelStore store(folder.path());
  const auto copy = [&](int from, int to) {
    std::filesystem::copy(folder.path() / "m" / std::to_string(from), folder.path() / "m" / std::to_string(to),
                          std::filesystem::copy_options::recursive);
  };
  CHECK(store.look("m").load == nullptr);
  CHECK(store.look("none").gone.empty());
  copy(1, 5);
  const auto appeared = store.look("m");
  REQUIRE(appeared.load);
  CHECK(appeared.appeared == 5);
  const auto fifth = appeared.load->wait();
  CHECK(store.pin({"m", 0, ""}) == fifth);
  CHECK(store.look("m").load == nullptr);

  copy(1, 9);
  std::filesystem::resize_file(folder.path() / "m/9/tensors.safetensors", 100);  // not whole yet
  CHECK(store.look("m").load == nullptr);
  std::filesystem::remove_all(folder.path() / "m/9");

  std::filesystem::remove_all(folder.path() / "m/5");
  const auto gone = store.look("m");
  CHECK(gone.gone == std::vector<std::uint64_t>{5});
  CHECK(gone.load == nullptr);
  CHECK(pinNow(store, {"m", 0, ""})->version == 2);
  std::filesystem::remove_all(folder.path() / "m");
  CHECK(store.look("m").gone == std::vector<std::uint64_t>{2});
  CHECK_THROWS_AS(store.pin({"m", 0, ""}), ModelNotFound);
}

TEST_CASE("a look passes over a broken version, and finds it again when it has changed") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 3);
  for (const int version : {2, 3})
    std::filesystem::rename(folder.path() / "m" / std::to_string(version),
                            folder.path() / ("." + std::to_string(version)));
  ModelStore store(folder.path());
  for (const int version : {2, 3})
    std::filesystem::rename(folder.path() / ("." + std::to_string(version)),
                            folder.path() / "m" / std::to_string(version));
  const auto tensors = folder.path() / "m/3/tensors.safetensors";
  const auto good = readFile(tensors);
  auto bad = good;
  bad.back() ^= 1;
  writeFile(tensors, bad);
  const auto broken = store.look("m");
  REQUIRE(broken.appeared == 3);
  CHECK_THROWS_AS(broken.load->wait(), FileError);
  const auto next = store.look("m");
  REQUIRE(next.appeared == 2);
  CHECK(next.load->wait()->version == 2);
  CHECK(store.look("m").load == nullptr);
  writeFile(tensors, good);
  const auto repaired = store.look("m");
  REQUIRE(repaired.appeared == 3);
  CHECK(repaired.load->wait()->version == 3);
}

TEST_CASE("a version can be fetched whether or not it is in memory") {
  const test::TemporaryFolder folder;
  publishVersions(folder.path(), 1);
  ModelStore store(folder.path());
  const auto model = store.fetch({"m", 0, ""})->wait();
  CHECK(model->version == 1);
  CHECK(store.fetch({"m", 1, ""})->get() == model);
  CHECK_THROWS_AS(store.fetch({"m", 2, ""}), ModelNotFound);
  CHECK_THROWS_AS(store.fetch({"n", 0, ""}), ModelNotFound);
}
