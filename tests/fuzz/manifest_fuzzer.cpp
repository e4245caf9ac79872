#include "core/io/file_error.h"
#include "core/io/model_directory.h"
#include "server/convert/model.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;
using server::toProto;

// A manifest as a store finds it: read, listed over the wire, and written again as another version's.
FUZZ_TARGET(manifest) {
  static const ModelDirectory directory(scratchFolder() / "models");
  std::filesystem::create_directories(scratchFolder() / "models" / "m" / "1");
  scratchFile("models/m/1/manifest.json", bytes);
  const auto manifest = accepted<FileError>([&] { return directory.manifest("m"); });
  if (!manifest) return;
  require(manifest->format_version >= 1, "the format version counts from 1");
  shaped::v1::ModelDescription description;
  toProto(server::ModelStore::Entry{"m", 1, *manifest, server::ModelState::kStored, 0, {}}, description);
  require(description.model().name() == "m", "the description names the model");
  if (!accepted<InvalidInput>([&] { return directory.publish("copy", *manifest, TensorWriter()); })) return;
  const auto back = directory.manifest("copy");
  directory.remove("copy");
  require(back.kind == manifest->kind && back.format_version == manifest->format_version, "kind and version survive");
  require(back.created_by == manifest->created_by, "the program survives");
  require(back.description == manifest->description, "the description survives");
}
