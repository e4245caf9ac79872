#include "server/datasets/dataset_info.h"

#include <limits>
#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

constexpr char kInfo[] = "dataset.json";
constexpr const char *kShapes = "shapes", *kScans = "scans";
constexpr std::int64_t kLatest = 9'000'000'000;  // seconds since 1970 that the clock's nanoseconds can hold

DatasetKind kindNamed(const std::string& text, const std::string& file) {
  if (text == kShapes) return DatasetKind::kShapes;
  if (text == kScans) return DatasetKind::kScans;
  throw InvalidInput(file, "is of kind \"" + text + "\", want shapes or scans");
}

}  // namespace

void writeDatasetInfo(const std::filesystem::path& folder, const DatasetInfo& info) {
  nlohmann::json document{
      {"name", info.name},
      {"kind", info.kind == DatasetKind::kScans ? kScans : kShapes},
      {"frames", info.frames},
      {"created", std::chrono::duration_cast<std::chrono::seconds>(info.created.time_since_epoch()).count()}};
  if (info.kind == DatasetKind::kShapes)
    document.update({{"vertices", info.vertex_count}, {"faces", info.face_count}, {"topology_id", info.topology_id}});
  writeFile(folder / kInfo, document.dump(2) + "\n");
}

DatasetInfo readDatasetInfo(const std::filesystem::path& folder) {
  using Index = std::numeric_limits<std::int32_t>;
  const auto path = folder / kInfo;
  const auto document = parseJson(path.string(), readFile(path));
  DatasetInfo info;
  info.name = document.at("name");
  info.kind = kindNamed(document.value("kind", kShapes), path.string());
  info.frames = requireWholeNumber(document, "frames", 1, std::numeric_limits<std::uint32_t>::max());
  info.created =
      std::chrono::system_clock::time_point(std::chrono::seconds(requireWholeNumber(document, "created", 0, kLatest)));
  if (info.kind == DatasetKind::kScans) return info;
  info.vertex_count = static_cast<std::int32_t>(requireWholeNumber(document, "vertices", 3, Index::max()));
  info.face_count = requireWholeNumber(document, "faces", 1, Index::max());
  info.topology_id = document.at("topology_id");
  return info;
}

}  // namespace shaped::server
