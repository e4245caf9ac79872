#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

namespace shaped::server {

enum class DatasetKind {
  kShapes,  ///< of one connectivity
  kScans    ///< raw ones, each a surface or points of its own
};

/// What is known of a dataset without reading what it holds.
struct DatasetInfo {
  std::string name;
  DatasetKind kind = DatasetKind::kShapes;
  std::int64_t frames = 0;        ///< shapes or scans
  std::int32_t vertex_count = 0;  ///< of shapes, as are the next two; 0 and "" of scans
  std::int64_t face_count = 0;
  std::string topology_id;
  std::chrono::system_clock::time_point created;
};

/// Writes <folder>/dataset.json. Throws FileError.
void writeDatasetInfo(const std::filesystem::path& folder, const DatasetInfo& info);

/// Reads <folder>/dataset.json; a file without a kind is of shapes. Throws what says that this is no dataset's folder.
DatasetInfo readDatasetInfo(const std::filesystem::path& folder);

}  // namespace shaped::server
