#pragma once

#include "core/io/model_directory.h"
#include "core/model/shell_pga_model.h"

namespace shaped {

/// The kind of a Shell PGA model's manifest.
inline constexpr const char* kShellPgaKind = "shell_pga";

/// Publishes a model as a new version and returns its number. provenance: an object that stands in the manifest's
/// description, for whoever keeps the store; the model does not read it. Throws as ModelDirectory::publish.
std::int64_t publishShellPga(const ModelDirectory& directory, const std::string& name, const ShellPgaModel& model,
                             const nlohmann::json& provenance = nlohmann::json::object());

/// Throws InvalidInput naming "manifest" when the kind or format version is none that shellPgaFrom() reads.
void requireShellPga(const ModelManifest& manifest);

/// Builds the model out of its files; its variations stay in the mapped file and keep that alive. Throws InvalidInput
/// when kind or format version is another, or tensors are missing, of the wrong shape, or make no valid mesh.
ShellPgaModelPtr shellPgaFrom(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors);

/// Builds the model that a stored version holds. Throws FileError naming the version when the kind or format version is
/// another, or tensors are missing, of the wrong shape, or make no valid mesh.
ShellPgaModelPtr loadShellPga(const StoredModel& stored);

}  // namespace shaped
