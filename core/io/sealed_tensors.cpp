#include "core/io/sealed_tensors.h"

#include "core/io/sha256.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr const char *kFormatKey = "format", *kSealKey = "sha256";
/// Stands in the seal's place while the file is hashed.
const std::string kBlank(64, '0');

std::string sealOf(std::string_view bytes, std::size_t seal_at) {
  Sha256 hash;
  hash.update(bytes.substr(0, seal_at));
  hash.update(kBlank);
  hash.update(bytes.substr(seal_at + kBlank.size()));
  return hash.finish();
}

}  // namespace

void writeSealed(const std::filesystem::path& path, TensorWriter& tensors, const std::string& format) {
  tensors.setMetadata(kFormatKey, format);
  tensors.setMetadata(kSealKey, kBlank);
  Sha256 hash;
  tensors.write([&](std::string_view bytes) { hash.update(bytes); });
  tensors.setMetadata(kSealKey, hash.finish());
  tensors.write(path);
}

const std::string& metadataOf(const TensorFile& file, const std::filesystem::path& path, const std::string& key) {
  const auto found = file.metadata().find(key);
  if (found == file.metadata().end()) throw InvalidInput(path.string(), "is not ours: its header has no " + key);
  return found->second;
}

void requireSealed(const TensorFile& file, const std::filesystem::path& path, const std::string& format) {
  if (const auto& found = metadataOf(file, path, kFormatKey); found != format)
    throw InvalidInput(path.string(), "has the format " + quotedWord(found) + ", want \"" + format + "\"");
  const auto& seal = metadataOf(file, path, kSealKey);
  const auto at = file.bytes().find(seal);
  if (seal.size() != kBlank.size() || at == std::string_view::npos || sealOf(file.bytes(), at) != seal)
    throw InvalidInput(path.string(), "is damaged: it does not have the SHA-256 that it states");
}

}  // namespace shaped
