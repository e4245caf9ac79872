#include "server/datasets/scan_files.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/io/tensor_file.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;

constexpr const char *kNames = "names.json", *kPoints = "points", *kNormals = "normals", *kFaces = "faces";

std::string fileOf(std::int64_t index) {
  char name[48];
  std::snprintf(name, sizeof name, "scan_%06lld.safetensors", static_cast<long long>(index));
  return name;
}

std::vector<std::string> readNames(const fs::path& path) try {
  return parseJson(path.string(), readFile(path)).get<std::vector<std::string>>();
} catch (const std::exception& error) {
  throw Corrupted(path.string() + ": holds no names of scans; delete the dataset and upload it again: " + error.what());
}

}  // namespace

void writeScanFile(const fs::path& folder, std::int64_t index, const Scan& scan) {
  TensorWriter file;
  file.addMatrix(kPoints, scan.points.cast<float>());
  if (scan.normals.rows() > 0) file.addMatrix(kNormals, scan.normals.cast<float>());
  if (scan.faces.rows() > 0) file.addMatrix(kFaces, scan.faces);
  file.write(folder / fileOf(index));
}

void writeScanNames(const fs::path& folder, const std::vector<std::string>& names) {
  writeFile(folder / kNames, nlohmann::json(names).dump() + "\n");
}

std::vector<std::string> scanFiles(std::int64_t count) {
  std::vector<std::string> files{kNames};
  for (std::int64_t i = 0; i < count; ++i) files.push_back(fileOf(i));
  return files;
}

DatasetScans::DatasetScans(fs::path folder) : folder_(std::move(folder)), names_(readNames(folder_ / kNames)) {}

Scan DatasetScans::scan(std::int64_t index) const try {
  const TensorFile file(folder_ / fileOf(index));
  Scan scan;
  scan.points = file.matrix<float>(kPoints, -1, 3).cast<double>();
  if (file.has(kNormals)) scan.normals = file.matrix<float>(kNormals, -1, 3).cast<double>();
  if (file.has(kFaces)) scan.faces = file.matrix<std::int32_t>(kFaces, -1, 3);
  requireUsableScan(scan, name(index));
  return scan;
} catch (const InvalidInput& error) {
  throw Corrupted(std::string(error.what()) + "; delete the dataset and upload it again");
}

}  // namespace shaped::server
