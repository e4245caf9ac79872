#include "client/scan_upload.h"

#include <algorithm>
#include <array>

#include "client/fingerprint.h"
#include "client/registration.h"
#include "client/sending.h"
#include "core/io/file.h"
#include "core/io/scan_file.h"
#include "core/numerics/error.h"

namespace shaped::client {
namespace {

namespace fs = std::filesystem;

bool mayBeScan(const fs::path& file) {
  constexpr std::array extensions{".ply", ".obj", ".off", ".stl", ".npy", ".xyz"};
  return std::find(extensions.begin(), extensions.end(), extensionOf(file)) != extensions.end();
}

v1::UploadDatasetRequest headerOf(const std::string& name, const ScanFolder& scans) {
  v1::UploadDatasetRequest message;
  auto& header = *message.mutable_header();
  header.set_name(name);
  header.set_kind(v1::DATASET_KIND_SCANS);
  header.set_frames(static_cast<std::uint32_t>(scans.count()));
  return message;
}

v1::UploadDatasetRequest scanOf(const ScanFolder& scans, std::int64_t index) {
  v1::UploadDatasetRequest message;
  *message.mutable_scan()->mutable_scan() = pack(scans.scan(index));
  message.mutable_scan()->set_name(scans.name(index));
  return message;
}

}  // namespace

ScanFolder::ScanFolder(const std::string& option, const fs::path& folder, double unit_factor)
    : unit_factor_(unit_factor) {
  std::error_code problem;
  for (const auto& entry : fs::directory_iterator(folder, problem))
    if (entry.is_regular_file(problem) && mayBeScan(entry.path())) files_.push_back(entry.path());
  if (problem) throw InvalidInput(option, folder.string() + " cannot be read as a folder: " + problem.message());
  if (files_.empty())
    throw InvalidInput(option, folder.string() + " holds no scans, which end in .ply, .obj, .off, .stl, .npy or .xyz");
  std::sort(files_.begin(), files_.end());
}

Scan ScanFolder::scan(std::int64_t index) const {
  auto scan = readScan(files_[static_cast<std::size_t>(index)]);
  scan.points *= unit_factor_;
  return scan;
}

std::string contentName(const ScanFolder& scans, const std::string& prefix) {
  Fingerprint fingerprint;
  for (std::int64_t i = 0; i < scans.count(); ++i) {
    const auto bytes = scanOf(scans, i).SerializeAsString();
    fingerprint.add(bytes.data(), bytes.size());
  }
  return datasetName("scans", prefix, fingerprint);
}

v1::Dataset uploadScans(const std::shared_ptr<grpc::Channel>& channel, const std::string& name, const ScanFolder& scans,
                        const CallOptions& options, const std::function<void(std::int64_t)>& progress) {
  const auto stub = v1::Datasets::NewStub(channel);
  Call call(options);
  v1::UploadDatasetResponse response;
  const auto writer = stub->Upload(call.context(), &response);
  sendAll(call, *writer, [&](const auto& send) {
    bool open = send(headerOf(name, scans));
    for (std::int64_t i = 0; open && i < scans.count(); ++i) {
      open = send(scanOf(scans, i));
      progress(i + 1);
    }
  });
  return response.dataset();
}

std::vector<v1::Dataset> listDatasets(const std::shared_ptr<grpc::Channel>& channel, const CallOptions& options) {
  Call call(options);
  v1::ListDatasetsResponse response;
  require(v1::Datasets::NewStub(channel)->List(call.context(), {}, &response));
  return {response.datasets().begin(), response.datasets().end()};
}

void deleteDataset(const std::shared_ptr<grpc::Channel>& channel, const std::string& name, const CallOptions& options) {
  Call call(options);
  v1::DeleteDatasetRequest request;
  request.set_name(name);
  v1::DeleteDatasetResponse response;
  require(v1::Datasets::NewStub(channel)->Delete(call.context(), request, &response));
}

}  // namespace shaped::client
