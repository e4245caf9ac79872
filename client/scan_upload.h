#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/connection.h"
#include "core/mesh/scan.h"
#include "shaped/v1/datasets.grpc.pb.h"

namespace shaped::client {

/// Raw scans out of the files of a folder, by name, read one at a time.
class ScanFolder {
 public:
  /// All files there that readScan() knows by their extension; folders within are not looked at. option: what errors
  /// call the folder. unit_factor: what makes metres of the files' unit, > 0. Throws InvalidInput when it is no folder
  /// or holds no scan.
  ScanFolder(const std::string& option, const std::filesystem::path& folder, double unit_factor);

  std::int64_t count() const { return std::ssize(files_); }
  /// The file's name.
  std::string name(std::int64_t index) const { return files_[static_cast<std::size_t>(index)].filename().string(); }
  /// In metres. Throws as readScan().
  Scan scan(std::int64_t index) const;

 private:
  std::vector<std::filesystem::path> files_;
  double unit_factor_;
};

/// A dataset name that follows from the content, so that the same scans are uploaded and kept once:
/// "scans-<prefix>-<16 hexadecimal digits>". Reads all scans.
std::string contentName(const ScanFolder& scans, const std::string& prefix);

/// Uploads the scans; `progress` hears how many have gone. Throws RpcError when the daemon refuses, InvalidInput when a
/// file is faulty; nothing is then kept on the daemon.
v1::Dataset uploadScans(const std::shared_ptr<grpc::Channel>& channel, const std::string& name, const ScanFolder& scans,
                        const CallOptions& options, const std::function<void(std::int64_t)>& progress);

/// By name. Throws RpcError.
std::vector<v1::Dataset> listDatasets(const std::shared_ptr<grpc::Channel>& channel, const CallOptions& options);
/// Throws RpcError.
void deleteDataset(const std::shared_ptr<grpc::Channel>& channel, const std::string& name, const CallOptions& options);

}  // namespace shaped::client
