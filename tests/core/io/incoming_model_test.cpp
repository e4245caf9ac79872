#include "core/io/incoming_model.h"

#include <catch2/catch.hpp>

#include "core/io/file_error.h"
#include "core/io/model_directory.h"
#include "core/numerics/error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// The files of a small model, published in a folder of its own.
ModelFiles someFiles() {
  const test::TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  TensorWriter tensors;
  tensors.add("a", {3000}, std::span<const double>(std::vector<double>(3000, 1.5)));
  ModelManifest manifest;
  manifest.kind = "small";
  manifest.created_by = "test";
  directory.publish("m", manifest, tensors);
  return directory.files("m");
}

std::size_t entriesOf(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

}  // namespace

TEST_CASE("what is received is published as it came, and only then") {
  const auto files = someFiles();
  const test::TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto text = " " + files.manifest_text;  // not as we would write it
  auto incoming = directory.receive("m", text);
  incoming->append(files.tensors->bytes().substr(0, 100));
  CHECK(directory.models().empty());
  incoming->append(files.tensors->bytes().substr(100));
  CHECK(incoming->finish()->values<double>("a")[2999] == 1.5);
  CHECK(directory.models().empty());
  CHECK(directory.publish(*incoming) == 1);
  incoming.reset();
  CHECK(directory.files("m").manifest_text == text);
  CHECK(directory.load("m").tensors->bytes() == files.tensors->bytes());
  CHECK(entriesOf(folder.path()) == 1);
  CHECK(entriesOf(folder.path() / "m") == 1);
}

TEST_CASE("what is not whole, or changed, is refused and leaves nothing") {
  const auto files = someFiles();
  const std::string bytes(files.tensors->bytes());
  const test::TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto refused = [&](std::string sent, const char* reason) {
    auto incoming = directory.receive("m", files.manifest_text);
    CHECK_THROWS_WITH(incoming->append(sent), Contains(reason));
  };
  refused(bytes + "x", "tensors: are more than");
  const auto unfinished = [&](std::string sent, const char* reason) {
    auto incoming = directory.receive("m", files.manifest_text);
    incoming->append(sent);
    CHECK_THROWS_WITH(incoming->finish(), Contains(reason));
  };
  unfinished(bytes.substr(1), "tensors: ended after");
  auto changed = bytes;
  changed.back() ^= 1;
  unfinished(changed, "tensors: have SHA-256");
  CHECK_THROWS_AS(directory.receive("m", "[]"), InvalidInput);
  CHECK_THROWS_AS(directory.receive("a/b", files.manifest_text), InvalidInput);
  CHECK(entriesOf(folder.path()) == 0);
}

TEST_CASE("a full disk leaves nothing of what was received") {
  const auto files = someFiles();
  const test::TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  {
    const test::FileSizeLimit limit(4096);
    auto incoming = directory.receive("m", files.manifest_text);
    CHECK_THROWS_AS(incoming->append(files.tensors->bytes()), FileError);
  }
  CHECK(entriesOf(folder.path()) == 0);
}

TEST_CASE("a model is deleted while another version of it is on its way") {
  const auto files = someFiles();
  const test::TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto receive = [&] {
    auto incoming = directory.receive("m", files.manifest_text);
    incoming->append(files.tensors->bytes());
    incoming->finish();
    return incoming;
  };
  directory.publish(*receive());
  auto late = receive();
  directory.remove("m");
  CHECK(directory.publish(*late) == 1);
  CHECK(directory.versions("m") == std::vector<std::int64_t>{1});
}

TEST_CASE("a start clears away what a killed receiver left") {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / ".scratch-1-0");
  folder.file(".scratch-1-0/tensors.safetensors.partial-1-0", "half");
  const ModelDirectory directory(folder.path());
  CHECK(entriesOf(folder.path()) == 0);
}
