#include "client/shapectl/scan_landmarks.h"

#include <limits>

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

std::uint32_t indexIn(const nlohmann::json& entry, const char* field) {
  return static_cast<std::uint32_t>(requireWholeNumber(entry, field, 0, std::numeric_limits<std::int32_t>::max()));
}

v1::ScanLandmark landmarkFrom(const nlohmann::json& entry) {
  v1::ScanLandmark landmark;
  if (entry.contains("vertex") == entry.contains("face")) throw InvalidInput("place", "want either vertex or face");
  if (entry.contains("vertex")) {
    landmark.set_vertex(indexIn(entry, "vertex"));
  } else {
    landmark.mutable_point()->set_face(indexIn(entry, "face"));
    for (const auto& weight : entry.at("barycentric")) landmark.mutable_point()->add_barycentric(weight.get<double>());
  }
  for (const auto& coordinate : entry.at("position")) landmark.add_position(coordinate.get<double>());
  if (landmark.position_size() != 3) throw InvalidInput("position", "want three numbers");
  if (entry.contains("weight")) landmark.set_weight(entry.at("weight").get<double>());
  return landmark;
}

/// Gives each landmark of the file to take(entry, landmark). fields: that are wanted beside a landmark's own. Throws
/// InvalidInput naming the file and the landmark.
template <class Take>
void readEach(const std::filesystem::path& path, const std::string& fields, const Take& take) {
  const auto document = parseJson(path.string(), readFile(path));
  if (!document.is_object() || !document.contains("landmarks") || !document.at("landmarks").is_array())
    throw InvalidInput(path.string(), "want {\"landmarks\": [...]}");
  std::size_t index = 0;
  const auto refuse = [&](const std::string& problem) {
    throw InvalidInput(path.string(), "landmarks[" + std::to_string(index) +
                                          "]: want {\"vertex\": i or \"face\": f, \"barycentric\": [3 weights], "
                                          "\"position\": [3 numbers]" +
                                          fields + "}" + problem);
  };
  try {
    for (const auto& entry : document.at("landmarks")) {
      take(entry, landmarkFrom(entry));
      ++index;
    }
  } catch (const InvalidInput& error) {
    refuse(std::string(": ") + error.what());
  } catch (const nlohmann::json::exception&) {  // a field is missing or of another type
    refuse("");
  }
}

}  // namespace

std::vector<v1::ScanLandmark> readScanLandmarks(const std::filesystem::path& path) {
  std::vector<v1::ScanLandmark> landmarks;
  readEach(path, "",
           [&](const nlohmann::json&, v1::ScanLandmark landmark) { landmarks.push_back(std::move(landmark)); });
  return landmarks;
}

std::vector<std::vector<v1::ScanLandmark>> readSequenceLandmarks(const std::filesystem::path& path,
                                                                 std::int64_t scans) {
  std::vector<std::vector<v1::ScanLandmark>> landmarks(static_cast<std::size_t>(scans));
  readEach(path, ", \"frame\": index of the scan", [&](const nlohmann::json& entry, v1::ScanLandmark landmark) {
    const bool only = scans == 1 && !entry.contains("frame");
    const auto frame = only ? 0 : requireWholeNumber(entry, "frame", 0, scans - 1);
    landmarks[static_cast<std::size_t>(frame)].push_back(std::move(landmark));
  });
  return landmarks;
}

}  // namespace shaped::shapectl
