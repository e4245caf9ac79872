#include "core/io/incoming_model.h"

#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr const char* kField = "tensors";

/// Nobody clears the scratch folder away before its owner holds it.
ScratchFolder lockedScratch(const std::filesystem::path& models) {
  const FolderLock lock(models);
  return ScratchFolder(models);
}

ModelManifest parsed(const std::string& text) try { return manifestFrom(text); } catch (const InvalidInput& problem) {
  throw InvalidInput("manifest", std::string("is no model manifest: ") + problem.what());
}

}  // namespace

IncomingModel::IncomingModel(std::string name, std::string manifest_text, const std::filesystem::path& models)
    : name_(std::move(name)),
      manifest_text_(std::move(manifest_text)),
      manifest_(parsed(manifest_text_)),
      scratch_(lockedScratch(models)),
      tensors_(scratch_.path() / kTensorsFile) {}

void IncomingModel::append(std::string_view bytes) {
  if (bytes.size() > manifest_.tensors_bytes - received_)
    throw InvalidInput(kField,
                       "are more than the " + std::to_string(manifest_.tensors_bytes) + " bytes of the manifest");
  hash_.update(bytes);
  tensors_.write(bytes);
  received_ += bytes.size();
}

std::shared_ptr<const TensorFile> IncomingModel::finish() {
  if (received_ != manifest_.tensors_bytes)
    throw InvalidInput(kField, "ended after " + std::to_string(received_) + " bytes, the manifest says " +
                                   std::to_string(manifest_.tensors_bytes));
  if (const auto hash = hash_.finish(); hash != manifest_.tensors_sha256)
    throw InvalidInput(kField, "have SHA-256 " + hash + ", the manifest says " + manifest_.tensors_sha256 +
                                   ": they are not what was published, or were changed on the way");
  tensors_.commit();
  writeFile(scratch_.path() / kManifestFile, manifest_text_);
  syncFolder(scratch_.path());
  return std::make_shared<const TensorFile>(scratch_.path() / kTensorsFile, kField);
}

}  // namespace shaped
