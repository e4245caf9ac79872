#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh/scan.h"

namespace shaped::server {

/// How a dataset of raw scans lies in its folder: scan_000000.safetensors and so on, each with `points` (N x 3 F32 [m])
/// and perhaps `normals` (N x 3 F32) and `faces` (F x 3 I32); names.json, an array of what the scans are called.

/// Throws FileError.
void writeScanFile(const std::filesystem::path& folder, std::int64_t index, const Scan& scan);
void writeScanNames(const std::filesystem::path& folder, const std::vector<std::string>& names);

/// The files of such a dataset, other than dataset.json.
std::vector<std::string> scanFiles(std::int64_t count);

/// The scans of a dataset, read one by one. Usable from several threads at once.
class DatasetScans {
 public:
  /// Throws Corrupted when names.json is missing or is none.
  explicit DatasetScans(std::filesystem::path folder);

  std::int64_t count() const { return std::ssize(names_); }
  /// What the client called it; its index where it did not. index in [0, count()), as below.
  const std::string& name(std::int64_t index) const { return names_[static_cast<std::size_t>(index)]; }
  /// Throws Corrupted when the file does not hold what was uploaded.
  Scan scan(std::int64_t index) const;

 private:
  std::filesystem::path folder_;
  std::vector<std::string> names_;
};

}  // namespace shaped::server
