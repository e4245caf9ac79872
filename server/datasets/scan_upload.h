#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh/scan.h"
#include "server/datasets/dataset_info.h"

namespace shaped::server {

class DatasetStore;

/// A dataset of raw scans on its way in: they are checked and written as they come. Destroyed before commit(), it
/// leaves nothing.
class ScanUpload {
 public:
  ~ScanUpload();
  ScanUpload(const ScanUpload&) = delete;
  ScanUpload& operator=(const ScanUpload&) = delete;

  /// "scans[3] (bob.ply)": what errors call the scan that comes next.
  std::string nextField(const std::string& name) const;
  /// name: what answers call the scan, at most 255 bytes; its index where empty. Throws InvalidInput naming the scan
  /// when it is not usable (requireUsableScan), its name too long, or one too many; FileError when the disk fails.
  void append(const Scan& scan, const std::string& name);
  /// Publishes the dataset. Throws InvalidInput when scans are missing, AlreadyExists when the name holds something
  /// else, FileError when the disk fails. Call once, last.
  DatasetInfo commit();

 private:
  friend class DatasetStore;
  ScanUpload(DatasetStore& store, std::string name, std::int64_t scans, std::filesystem::path folder);

  DatasetStore& store_;
  const std::string name_;
  const std::int64_t scans_;
  const std::filesystem::path folder_;
  std::vector<std::string> names_;
};

}  // namespace shaped::server
