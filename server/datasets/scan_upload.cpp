#include "server/datasets/scan_upload.h"

#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"
#include "server/datasets/dataset_store.h"
#include "server/datasets/scan_files.h"

namespace shaped::server {

namespace {

constexpr std::size_t kLongestName = 255;

}  // namespace

ScanUpload::ScanUpload(DatasetStore& store, std::string name, std::int64_t scans, std::filesystem::path folder)
    : store_(store), name_(std::move(name)), scans_(scans), folder_(std::move(folder)) {
  std::filesystem::create_directory(folder_);
}

ScanUpload::~ScanUpload() {
  std::error_code ignored;  // what stays behind is removed at the next start
  std::filesystem::remove_all(folder_, ignored);
}

std::string ScanUpload::nextField(const std::string& name) const {
  return "scans[" + std::to_string(names_.size()) + "]" + (name.empty() ? "" : " (" + name + ")");
}

void ScanUpload::append(const Scan& scan, const std::string& name) {
  const auto field = nextField(name.size() > kLongestName ? "" : name);
  if (std::ssize(names_) >= scans_)
    throw InvalidInput(field, "is one too many: the header announced " + std::to_string(scans_) + " scans");
  if (name.size() > kLongestName)
    throw InvalidInput(
        field, "has a name of " + std::to_string(name.size()) + " bytes, want at most " + std::to_string(kLongestName));
  requireUsableScan(scan, field);
  writeScanFile(folder_, std::ssize(names_), scan);
  names_.push_back(name.empty() ? std::to_string(names_.size()) : name);
}

DatasetInfo ScanUpload::commit() {
  if (std::ssize(names_) != scans_)
    throw InvalidInput(
        "scans", "the header announced " + std::to_string(scans_) + ", " + std::to_string(names_.size()) + " came");
  writeScanNames(folder_, names_);
  return store_.publish(
      {.name = name_, .kind = DatasetKind::kScans, .frames = scans_, .topology_id = {}, .created = {}}, folder_);
}

}  // namespace shaped::server
