#include "core/io/model_manifest.h"

#include <limits>

#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped {

using nlohmann::json;

std::string textOf(const ModelManifest& manifest) {
  if (manifest.kind.empty() || manifest.format_version < 1)
    throw InvalidInput("manifest", "needs a kind and a format version of at least 1");
  if (!manifest.description.is_object()) throw InvalidInput("manifest.description", "must be a JSON object");
  const json tensors = {{"file", kTensorsFile}, {"bytes", manifest.tensors_bytes}, {"sha256", manifest.tensors_sha256}};
  const json document = {{"kind", manifest.kind},
                         {"format_version", manifest.format_version},
                         {"created_by", manifest.created_by},
                         {"tensors", tensors},
                         {"description", manifest.description}};
  try {
    return document.dump(2) + "\n";
  } catch (const json::exception&) {
    throw InvalidInput("manifest", "holds text that is not UTF-8");
  }
}

ModelManifest manifestFrom(const std::string& text) try {
  const auto document = parseJson("manifest", text);
  ModelManifest manifest;
  document.at("kind").get_to(manifest.kind);
  manifest.format_version =
      static_cast<int>(requireWholeNumber(document, "format_version", 1, std::numeric_limits<int>::max()));
  document.at("created_by").get_to(manifest.created_by);
  document.at("tensors").at("sha256").get_to(manifest.tensors_sha256);
  manifest.tensors_bytes = static_cast<std::uint64_t>(
      requireWholeNumber(document.at("tensors"), "bytes", 0, std::numeric_limits<std::int64_t>::max()));
  manifest.description = document.at("description");
  if (!manifest.description.is_object()) throw InvalidInput("description", "must be a JSON object");
  return manifest;
} catch (const json::exception& problem) {
  throw InvalidInput("manifest", problem.what());
}

}  // namespace shaped
