#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/io/tensor_file.h"
#include "core/numerics/error.h"

namespace shaped {

/// There is no model, or no version of it, under the name that was asked for.
class ModelNotFound : public InvalidInput {
 public:
  using InvalidInput::InvalidInput;
};

/// What manifest.json says about a model, whatever its kind.
struct ModelManifest {
  std::string kind;                                       ///< names the code that reads the tensors: "shell_pga"
  int format_version = 1;                                 ///< of that kind's tensors and description, >= 1
  std::string created_by;                                 ///< program and version: "shaped 0.1.0"
  nlohmann::json description = nlohmann::json::object();  ///< what the kind wants to say; an object
  std::string tensors_sha256;                             ///< set by publish(): 64 hexadecimal digits
  std::uint64_t tensors_bytes = 0;                        ///< set by publish()
};

/// One version of a model out of the store, verified.
struct StoredModel {
  std::string name;
  std::int64_t version;
  ModelManifest manifest;
  std::shared_ptr<const TensorFile> tensors;  ///< stays readable when the version is removed
};

/// A folder of models: <folder>/<model>/<version>/manifest.json and tensors.safetensors. Versions are integers from 1.
/// A version appears complete or not at all, never changes, and its number is not used again while the model exists.
/// Any number of threads and processes of one machine may publish, read and remove at the same time.
/// Names are of A-Z a-z 0-9 . _ -, at most 100 characters, the first no dot; every function throws InvalidInput for
/// others.
class ModelDirectory {
 public:
  /// Creates the folder when it is missing, and clears away what crashed processes left in it. Throws FileError when
  /// that fails.
  explicit ModelDirectory(std::filesystem::path folder);

  /// Writes a new version and returns its number, one above the highest ever given. Everything is on the disk when it
  /// returns. Throws FileError when writing fails (a full disk): then nothing is left behind. Clears away what crashed
  /// publishers of the same model left. Throws InvalidInput when the manifest has no kind or no object as description.
  std::int64_t publish(const std::string& model, ModelManifest manifest, const TensorWriter& tensors) const;

  /// The newest version, or the one asked for. Throws ModelNotFound; FileError when the files are damaged: the manifest
  /// is no manifest, or the tensor file has not the size and SHA-256 that it states.
  StoredModel load(const std::string& model, std::optional<std::int64_t> version = {}) const;
  /// The manifest alone, without looking at the tensors. Throws as load().
  ModelManifest manifest(const std::string& model, std::optional<std::int64_t> version = {}) const;

  /// Names with at least one version, sorted.
  std::vector<std::string> models() const;
  /// Versions in rising order; empty when there is no such model.
  std::vector<std::int64_t> versions(const std::string& model) const;

  /// Tells one state of a version's files from another without reading them; empty when they are not there.
  std::string fingerprint(const std::string& model, std::int64_t version) const;

  /// The labels of a model and the versions they stand for. A version may have gone since. Throws FileError when their
  /// file is damaged.
  std::map<std::string, std::int64_t> labels(const std::string& model) const;
  /// Lets a label, a name like a model's, stand for a version, or for none (0). Throws ModelNotFound, InvalidInput,
  /// FileError.
  void setLabel(const std::string& model, const std::string& label, std::int64_t version) const;

  /// Removes one version, or the model with all of them. Throws ModelNotFound, or FileError when removing fails.
  void remove(const std::string& model, std::int64_t version) const;
  void remove(const std::string& model) const;

 private:
  std::filesystem::path folderOf(const std::string& model) const;
  std::filesystem::path folderOf(const std::string& model, std::optional<std::int64_t>& version) const;

  std::filesystem::path folder_;
};

}  // namespace shaped
