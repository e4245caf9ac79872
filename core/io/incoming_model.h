#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/io/file.h"
#include "core/io/folder.h"
#include "core/io/model_manifest.h"
#include "core/io/sha256.h"
#include "core/io/tensor_file.h"

namespace shaped {

/// A version on its way into a ModelDirectory from elsewhere: its manifest, then the bytes of its tensors, kept as they
/// come in a scratch folder that no one lists. Destroyed before it is published, it leaves nothing behind. Made by
/// ModelDirectory::receive and published by it. Not for several threads at a time.
class IncomingModel {
 public:
  /// Throws InvalidInput naming "manifest" when the text is none, FileError when the disk fails.
  IncomingModel(std::string name, std::string manifest_text, const std::filesystem::path& models);

  const std::string& name() const { return name_; }
  const ModelManifest& manifest() const { return manifest_; }

  /// The next bytes of the tensor file. Throws InvalidInput naming "tensors" when they are more than the manifest says,
  /// FileError when the disk fails.
  void append(std::string_view bytes);

  /// All bytes have come: puts them on the disk, compares size and SHA-256 with the manifest and maps the tensors.
  /// Throws InvalidInput naming "tensors" when they differ or are no tensor file, FileError. Call once.
  std::shared_ptr<const TensorFile> finish();

 private:
  friend class ModelDirectory;

  const std::string name_, manifest_text_;
  const ModelManifest manifest_;
  ScratchFolder scratch_;
  FileWriter tensors_;
  Sha256 hash_;
  std::uint64_t received_ = 0;
};

}  // namespace shaped
