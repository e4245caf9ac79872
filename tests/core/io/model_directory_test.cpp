#include "core/io/model_directory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <mutex>
#include <thread>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/folder.h"
#include "core/io/sha256.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

TensorWriter someTensors(double value = 1) {
  TensorWriter writer;
  writer.addMatrix("mean", Eigen::MatrixXd::Constant(100, 3, value));
  return writer;
}

ModelManifest someManifest() {
  ModelManifest manifest;
  manifest.kind = "shell_pga";
  manifest.format_version = 3;
  manifest.created_by = "shaped 0.1.0";
  manifest.description = {{"modes", 20}, {"name", "K\xc3\xb6rper"}};
  return manifest;
}

std::vector<std::string> everythingIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    names.push_back(std::filesystem::relative(entry.path(), folder).string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST_CASE("a published model reads back with its manifest and tensors") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder / "deep" / "store");
  CHECK(store.models().empty());
  CHECK(store.publish("body", someManifest(), someTensors()) == 1);
  CHECK(store.publish("body", someManifest(), someTensors(2)) == 2);
  CHECK(store.publish("Horse_2.x-y", someManifest(), someTensors()) == 1);
  CHECK(store.models() == std::vector<std::string>{"Horse_2.x-y", "body"});
  CHECK(store.versions("body") == std::vector<std::int64_t>{1, 2});
  const auto model = store.load("body");
  CHECK(model.version == 2);
  CHECK(model.name == "body");
  CHECK(model.manifest.kind == "shell_pga");
  CHECK(model.manifest.format_version == 3);
  CHECK(model.manifest.created_by == "shaped 0.1.0");
  CHECK(model.manifest.description == someManifest().description);
  CHECK(model.manifest.tensors_sha256 == sha256(model.tensors->bytes()));
  CHECK(model.manifest.tensors_bytes == model.tensors->bytes().size());
  CHECK(model.tensors->values<double>("mean")[0] == 2);
  CHECK(store.load("body", 1).tensors->values<double>("mean")[0] == 1);
  CHECK(store.manifest("body", 1).tensors_sha256 != model.manifest.tensors_sha256);
  CHECK(everythingIn(folder / "deep" / "store" / "body") ==
        std::vector<std::string>{"1", "1/manifest.json", "1/tensors.safetensors", "2", "2/manifest.json",
                                 "2/tensors.safetensors"});
}

TEST_CASE("names that are no names are refused") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder / "store");
  for (const std::string name : {"", ".", "..", ".hidden", "../x", "a/b", "a b", "a\n", "\xc3\xa4"}) {
    INFO(name);
    CHECK_THROWS_WITH(store.publish(name, someManifest(), someTensors()),
                      Contains("model: ") && Contains("is no name"));
    CHECK_THROWS_AS(store.load(name), InvalidInput);
    CHECK_THROWS_AS(store.versions(name), InvalidInput);
    CHECK_THROWS_AS(store.remove(name), InvalidInput);
  }
  CHECK_THROWS_AS(store.publish(std::string(101, 'a'), someManifest(), someTensors()), InvalidInput);
  CHECK(everythingIn(folder.path()) == std::vector<std::string>{"store"});
}

TEST_CASE("a manifest that says nothing is refused") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  auto manifest = someManifest();
  manifest.kind = "";
  CHECK_THROWS_WITH(store.publish("a", manifest, someTensors()), Contains("manifest: needs a kind"));
  manifest = someManifest();
  manifest.description = 3;
  CHECK_THROWS_WITH(store.publish("a", manifest, someTensors()), Contains("manifest.description: must be"));
  manifest = someManifest();
  manifest.description["name"] = "\xff";
  CHECK_THROWS_WITH(store.publish("a", manifest, someTensors()), Contains("manifest: holds text that is not UTF-8"));
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("models and versions that are not there are named") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  CHECK_THROWS_AS(store.load("body"), ModelNotFound);
  CHECK_THROWS_WITH(store.load("body"), Contains("model: there is no model 'body'"));
  store.publish("body", someManifest(), someTensors());
  CHECK_THROWS_AS(store.load("body", 2), ModelNotFound);
  CHECK_THROWS_WITH(store.load("body", 2), Contains("model: 'body' has no version 2; the newest is 1"));
  CHECK_THROWS_AS(store.remove("body", 2), ModelNotFound);
  CHECK_THROWS_AS(store.remove("other"), ModelNotFound);
}

TEST_CASE("a removed version stays readable where it is loaded, and its number is not given again") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors(1));
  store.publish("body", someManifest(), someTensors(2));
  const auto loaded = store.load("body", 2);
  store.remove("body", 2);
  CHECK(loaded.tensors->values<double>("mean")[299] == 2);
  CHECK(store.versions("body") == std::vector<std::int64_t>{1});
  CHECK(store.publish("body", someManifest(), someTensors()) == 3);
  store.remove("body", 1);
  store.remove("body", 3);
  CHECK(store.models().empty());
  CHECK(store.publish("body", someManifest(), someTensors()) == 4);
  store.remove("body");
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("files are worked on while they are verified, and what was thrown counts only if they are whole") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors());
  double seen = 0;
  const auto stored = store.load("body", {}, [&](const StoredModel& unverified) {
    CHECK(unverified.version == 1);
    seen = unverified.tensors->values<double>("mean")[0];
  });
  CHECK(seen == stored.tensors->values<double>("mean")[0]);
  const auto fail = [](const StoredModel&) { throw InvalidInput("variations[0]", "is no shape"); };
  CHECK_THROWS_WITH(store.load("body", {}, fail), Contains("variations[0]: is no shape"));
  const auto tensors = folder.path() / "body" / "1" / "tensors.safetensors";
  auto flipped = readFile(tensors);
  flipped.back() = static_cast<char>(flipped.back() ^ 1);
  writeFile(tensors, flipped);
  for (int time = 0; time < 2; ++time)
    CHECK_THROWS_WITH(store.load("body", {}, fail), Contains("tensors.safetensors: has SHA-256 "));
  CHECK_THROWS_WITH(store.load("body", {}, [](const StoredModel&) {}), Contains("tensors.safetensors: has SHA-256 "));
}

TEST_CASE("a damaged model is refused and names its file") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors());
  const auto tensors = folder.path() / "body" / "1" / "tensors.safetensors";
  const auto manifest = folder.path() / "body" / "1" / "manifest.json";
  const auto whole = readFile(tensors), whole_manifest = readFile(manifest);
  auto flipped = whole;
  flipped.back() = static_cast<char>(flipped.back() ^ 1);
  writeFile(tensors, flipped);
  CHECK_THROWS_AS(store.load("body"), FileError);
  CHECK_THROWS_WITH(store.load("body"), Contains("tensors.safetensors: has SHA-256 ") && Contains("its manifest says"));
  TensorWriter other;
  other.addMatrix("mean", Eigen::MatrixXd::Zero(1, 1));
  other.write(tensors);
  CHECK_THROWS_WITH(store.load("body"), Contains("tensors.safetensors: has ") && Contains("bytes, its manifest says"));
  writeFile(tensors, whole.substr(0, whole.size() - 1));
  CHECK_THROWS_WITH(store.load("body"), Contains("tensors.safetensors: is damaged"));
  writeFile(tensors, whole);
  CHECK_NOTHROW(store.load("body"));
  writeFile(manifest, whole_manifest.substr(0, 40));
  CHECK_THROWS_AS(store.load("body"), FileError);
  CHECK_THROWS_WITH(store.manifest("body"), Contains("manifest.json: is no model manifest"));
  writeFile(manifest, "{\"kind\": 3}");
  CHECK_THROWS_WITH(store.manifest("body"), Contains("manifest.json: is no model manifest"));
  const std::string deep(100000, '[');
  writeFile(manifest, "{\"description\": " + deep + std::string(100000, ']') + "}");
  CHECK_THROWS_WITH(store.manifest("body"), Contains("nests deeper than 100 levels"));
  std::filesystem::remove(manifest);
  CHECK_THROWS_WITH(store.manifest("body"), Contains("manifest.json: is no model manifest"));
}

TEST_CASE("a full disk while publishing leaves nothing behind and loses nothing") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors());
  const auto before = everythingIn(folder.path());
  // Full while writing the tensors, at their last byte, and while writing the manifest.
  const auto tensor_bytes = store.manifest("body").tensors_bytes;
  auto long_manifest = someManifest();
  long_manifest.description["text"] = std::string(10000, 'x');
  struct Case {
    std::uint64_t limit;
    ModelManifest manifest;
    const char* file;
  };
  for (const auto& [limit, manifest, file] :
       {Case{100, someManifest(), "tensors.safetensors"}, Case{tensor_bytes - 1, someManifest(), "tensors.safetensors"},
        Case{tensor_bytes, long_manifest, "manifest.json"}})
    for (const char* model : {"body", "new"}) {
      std::string error;
      {
        const test::FileSizeLimit full(limit);
        try {
          store.publish(model, manifest, someTensors());
        } catch (const FileError& thrown) {
          error = thrown.what();
        }
      }
      INFO(limit << " " << model);
      CHECK_THAT(error, Contains(file) && Contains("cannot be written"));
      CHECK(everythingIn(folder.path()) == before);
    }
  CHECK_NOTHROW(store.load("body"));
  CHECK(store.publish("body", someManifest(), someTensors()) == 2);
}

TEST_CASE("publishers at the same time get different versions, and readers never see half a model") {
  const test::TemporaryFolder folder;
  std::mutex mutex;
  std::vector<std::int64_t> given;
  std::vector<std::string> errors;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      try {
        const ModelDirectory store(folder.path());
        for (int i = 0; i < 10; ++i) {
          const auto version = store.publish("body", someManifest(), someTensors());
          store.load("body");
          const std::lock_guard lock(mutex);
          given.push_back(version);
        }
      } catch (const std::exception& error) {
        const std::lock_guard lock(mutex);
        errors.emplace_back(error.what());
      }
    });
  for (auto& thread : threads) thread.join();
  CHECK(errors == std::vector<std::string>{});
  std::sort(given.begin(), given.end());
  REQUIRE(given.size() == 40);
  for (std::size_t i = 0; i < given.size(); ++i) CHECK(given[i] == static_cast<std::int64_t>(i) + 1);
  CHECK(everythingIn(folder.path()).size() == 1 + 3 * 40);
}

TEST_CASE("what a crashed publisher left is cleared away by the next one, not what a living one works on") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors());
  std::filesystem::create_directory(folder.path() / "body" / ".scratch-999999-0");
  folder.file("body/.scratch-999999-0/tensors.safetensors", "half");
  const ScratchFolder living(folder.path() / "body");
  CHECK(store.publish("body", someManifest(), someTensors()) == 2);
  CHECK_FALSE(std::filesystem::exists(folder.path() / "body" / ".scratch-999999-0"));
  CHECK(std::filesystem::exists(living.path()));
  CHECK(store.versions("body") == std::vector<std::int64_t>{1, 2});
}

TEST_CASE("entries that are no versions are not listed") {
  const test::TemporaryFolder folder;
  const ModelDirectory store(folder.path());
  store.publish("body", someManifest(), someTensors());
  for (const char* name : {"01", "-1", "x", "1.5", "0", "99999999999999999999"})
    std::filesystem::create_directory(folder.path() / "body" / name);
  folder.file("body/7", "a file");
  folder.file("stray", "a file");
  CHECK(store.versions("body") == std::vector<std::int64_t>{1});
  CHECK(store.models() == std::vector<std::string>{"body"});
}

TEST_CASE("a store that cannot be made is a FileError") {
  const test::TemporaryFolder folder;
  folder.file("file", "x");
  CHECK_THROWS_AS(ModelDirectory(folder / "file" / "store"), FileError);
}
