#include "core/io/marker_set_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/io/file.h"
#include "core/io/text_scanner.h"
#include "core/markers/marker_trial.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using nlohmann::json;

constexpr double kWeightTolerance = 1e-6;

/// One entry of "markers", with its place for error texts.
struct Entry {
  const std::string& file;
  const json& fields;
  std::string place;

  [[noreturn]] void fail(const std::string& problem) const { throw InvalidInput(file, place + " " + problem); }

  std::int32_t index(const std::string& field, std::int32_t count) const {
    const auto& value = fields.at(field);
    if (!value.is_number_integer()) fail("has a " + field + " that is no whole number");
    if (value < 0 || value >= count)
      fail("has " + field + " " + value.dump() + ", outside [0, " + std::to_string(count) + ")");
    return value.get<std::int32_t>();
  }

  Eigen::Vector3d vector(const std::string& field) const {
    const auto& value = fields.at(field);
    const auto number = [](const json& one) { return one.is_number(); };
    if (!value.is_array() || value.size() != 3 || !std::all_of(value.begin(), value.end(), number))
      fail("needs three numbers as " + field);
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
  }
};

/// The field that holds vertices of a template with this vertex count; empty when the set names no such template.
std::string vertexFieldFor(const json& document, std::int32_t vertex_count) {
  constexpr std::string_view prefix = "topology_";
  for (const auto& [key, value] : document.items())
    if (key.starts_with(prefix) && value == vertex_count) return "vertex_" + key.substr(prefix.size());
  return {};
}

Eigen::Vector3d readWeights(const Entry& entry) {
  const auto weights = entry.vector("barycentric");
  if (weights.minCoeff() < 0 || !(std::abs(weights.sum() - 1) <= kWeightTolerance))
    entry.fail("has barycentric weights that are negative or do not sum to 1");
  return weights;
}

MarkerSet::Marker readMarker(const Entry& entry, const std::string& vertex_field, std::int32_t vertex_count,
                             std::int32_t face_count) {
  MarkerSet::Marker marker;
  const auto has = [&](const std::string& field) { return !field.empty() && entry.fields.contains(field); };
  marker.label = entry.fields.at("label").get<std::string>();
  if (has("vertex") && has("face")) entry.fail("has both a vertex and a face; want one");
  if (has("vertex")) {
    marker.vertex = entry.index("vertex", vertex_count);
  } else if (has("face")) {
    if (!has("barycentric")) entry.fail("has a face without barycentric weights");
    marker.face = entry.index("face", face_count);
    marker.barycentric = readWeights(entry);
  } else if (has(vertex_field)) {
    marker.vertex = entry.index(vertex_field, vertex_count);
  } else {
    entry.fail("has no place: want vertex, or face and barycentric, for a template of " + std::to_string(vertex_count) +
               " vertices");
  }
  for (const std::string field : {"offset", "real_marker_offset_m"})
    if (has(field)) {
      marker.offset = entry.vector(field);
      break;
    }
  return marker;
}

std::string joined(const std::vector<std::string>& labels) {
  std::string text;
  for (const auto& label : labels) text += (text.empty() ? "" : ", ") + quotedWord(label);
  return text;
}

}  // namespace

MarkerSet parseMarkerSet(const std::string& file, std::string_view text, std::int32_t vertex_count,
                         std::int32_t face_count) {
  const auto document = json::parse(text, nullptr, false);
  if (document.is_discarded()) throw InvalidInput(file, "is no JSON");
  if (!document.is_object() || !document.contains("markers") || !document["markers"].is_array())
    throw InvalidInput(file, "has no list 'markers'");
  const auto vertex_field = vertexFieldFor(document, vertex_count);
  MarkerSet set;
  std::set<std::string> labels;
  for (const auto& fields : document["markers"]) {
    Entry entry{file, fields, "markers[" + std::to_string(set.markers.size()) + "]"};
    if (!fields.is_object() || !fields.contains("label") || !fields["label"].is_string() || fields["label"] == "")
      entry.fail("has no label");
    entry.place += " (" + quotedWord(fields["label"].get<std::string>()) + ")";
    set.markers.push_back(readMarker(entry, vertex_field, vertex_count, face_count));
    if (!labels.insert(set.markers.back().label).second) entry.fail("has a label that an earlier marker has");
  }
  if (set.markers.empty()) throw InvalidInput(file, "has no markers");
  return set;
}

MarkerSet readMarkerSet(const std::filesystem::path& path, std::int32_t vertex_count, std::int32_t face_count) {
  return parseMarkerSet(path.string(), readFile(path), vertex_count, face_count);
}

void writeMarkerSet(const std::filesystem::path& path, const MarkerSet& set) {
  json markers = json::array();
  const auto list = [](const Eigen::Vector3d& vector) { return json{vector[0], vector[1], vector[2]}; };
  for (const auto& marker : set.markers) {
    json entry = {{"label", marker.label}};
    if (marker.vertex >= 0) {
      entry["vertex"] = marker.vertex;
    } else {
      entry["face"] = marker.face;
      entry["barycentric"] = list(marker.barycentric);
    }
    if (!marker.offset.isZero(0)) entry["offset"] = list(marker.offset);
    markers.push_back(std::move(entry));
  }
  writeFile(path, json{{"markers", std::move(markers)}}.dump(2) + "\n");
}

std::vector<std::int32_t> matchLabels(const MarkerSet& set, std::span<const std::string> trial_labels,
                                      bool allow_absent) {
  std::vector<std::int32_t> columns;
  std::vector<std::string> absent;
  for (const auto& marker : set.markers) {
    const auto whole = std::find(trial_labels.begin(), trial_labels.end(), marker.label);
    const auto same = [&](const std::string& label) { return withoutSubject(label) == withoutSubject(marker.label); };
    const auto found =
        whole != trial_labels.end() ? whole : std::find_if(trial_labels.begin(), trial_labels.end(), same);
    columns.push_back(found == trial_labels.end() ? -1 : static_cast<std::int32_t>(found - trial_labels.begin()));
    if (found == trial_labels.end())
      absent.push_back(marker.label);
    else if (const auto other = whole != trial_labels.end() ? std::find(found + 1, trial_labels.end(), marker.label)
                                                            : std::find_if(found + 1, trial_labels.end(), same);
             other != trial_labels.end())
      throw InvalidInput("markers", quotedWord(marker.label) + " matches two labels of the trial, " +
                                        quotedWord(*found) + " and " + quotedWord(*other) +
                                        "; name the subject in the marker set");
  }
  if (!absent.empty() && !allow_absent)
    throw InvalidInput("markers", "the trial has no " + joined(absent) + "; its labels are " +
                                      joined({trial_labels.begin(), trial_labels.end()}));
  if (const auto matches = columns.size() - absent.size(); matches < 3)
    throw InvalidInput("markers", "only " + std::to_string(matches) + " of " + std::to_string(columns.size()) +
                                      " markers are in the trial; want at least 3");
  return columns;
}

}  // namespace shaped
