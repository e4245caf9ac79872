#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/io/incoming_model.h"
#include "core/io/model_manifest.h"
#include "core/io/tensor_file.h"
#include "core/numerics/error.h"

namespace shaped {

/// There is no model, or no version of it, under the name that was asked for.
class ModelNotFound : public InvalidInput {
 public:
  using InvalidInput::InvalidInput;
};

/// One version of a model out of the store, verified.
struct StoredModel {
  std::string name;
  std::int64_t version;
  ModelManifest manifest;
  std::shared_ptr<const TensorFile> tensors;  ///< stays readable when the version is removed
};

/// The files of one version as they are, to be handed on.
struct ModelFiles {
  std::string name;
  std::int64_t version;
  std::string manifest_text;
  ModelManifest manifest;
  std::shared_ptr<const TensorFile> tensors;  ///< not compared with the manifest's SHA-256
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

  /// Takes in a version from elsewhere, in a scratch folder. Throws InvalidInput when the text is no manifest,
  /// FileError when the disk fails.
  std::unique_ptr<IncomingModel> receive(const std::string& model, std::string manifest_text) const;
  /// Gives what has come, and was finished, the next number; its files are those that were sent, to the bit. Throws
  /// FileError when the disk fails.
  std::int64_t publish(IncomingModel& incoming) const;

  /// The newest version, or the one asked for. Throws ModelNotFound; FileError when the files are damaged: the manifest
  /// is no manifest, or the tensor file has not the size and SHA-256 that it states.
  /// meanwhile: is called with the files while another thread compares the SHA-256, so that one reading serves both;
  /// what it makes of them is to be thrown away when load() throws. What it throws is thrown on if the files are what
  /// they should be.
  StoredModel load(const std::string& model, std::optional<std::int64_t> version = {},
                   const std::function<void(const StoredModel&)>& meanwhile = {}) const;
  /// The manifest alone, without looking at the tensors. Throws as load().
  ModelManifest manifest(const std::string& model, std::optional<std::int64_t> version = {}) const;

  /// The files of a version. Throws as load(), but reads the tensors' header only.
  ModelFiles files(const std::string& model, std::optional<std::int64_t> version = {}) const;

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
