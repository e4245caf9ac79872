#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace shaped {

/// The files of a model's version.
inline constexpr const char *kManifestFile = "manifest.json", *kTensorsFile = "tensors.safetensors";

/// What manifest.json says about a model, whatever its kind.
struct ModelManifest {
  std::string kind;                                       ///< names the code that reads the tensors: "shell_pga"
  int format_version = 1;                                 ///< of that kind's tensors and description, >= 1
  std::string created_by;                                 ///< program and version: "shaped 0.1.0"
  nlohmann::json description = nlohmann::json::object();  ///< what the kind wants to say; an object
  std::string tensors_sha256;                             ///< set by publish(): 64 hexadecimal digits
  std::uint64_t tensors_bytes = 0;                        ///< set by publish()
};

/// As it stands in manifest.json. Throws InvalidInput when there is no kind, no object as description, a format version
/// below 1, or text that is not UTF-8.
std::string textOf(const ModelManifest& manifest);

/// Throws InvalidInput when the text is no model manifest: no JSON, or a field missing or of another type.
ModelManifest manifestFrom(const std::string& text);

}  // namespace shaped
