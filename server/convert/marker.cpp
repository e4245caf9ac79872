#include "server/convert/marker.h"

#include <cmath>
#include <limits>
#include <map>

#include "core/numerics/error.h"
#include "server/convert/mesh.h"

namespace shaped::server {
namespace {

using Numbers = google::protobuf::RepeatedField<double>;

std::string indexed(const std::string& field, std::size_t index) { return field + "[" + std::to_string(index) + "]"; }

Eigen::Vector3d threeNumbers(const Numbers& numbers, const std::string& field) {
  if (numbers.size() != 3) throw InvalidInput(field, "has " + std::to_string(numbers.size()) + " numbers, want three");
  const Eigen::Vector3d vector(numbers[0], numbers[1], numbers[2]);
  if (!vector.allFinite()) throw InvalidInput(field, "has a number that is not finite");
  return vector;
}

// Beyond the integers of the core, the index cannot be on any model: one past them says so there.
std::int32_t indexOf(std::uint32_t index) {
  constexpr std::uint32_t largest = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::min(index, largest));
}

MarkerSet::Marker markerFromProto(const v1::MarkerSet::Marker& message, const std::string& field) {
  MarkerSet::Marker marker;
  marker.label = message.label();
  if (marker.label.empty()) throw InvalidInput(field + ".label", "is empty");
  if (message.has_vertex()) {
    marker.vertex = indexOf(message.vertex());
  } else if (message.has_point()) {
    marker.face = indexOf(message.point().face());
    marker.barycentric = threeNumbers(message.point().barycentric(), field + ".point.barycentric");
  } else {
    throw InvalidInput(field + ".place", "is missing: name a vertex or a point of a face");
  }
  if (!message.offset().empty()) marker.offset = threeNumbers(message.offset(), field + ".offset");
  return marker;
}

}  // namespace

MarkerSet markerSetFromProto(const v1::MarkerSet& message,
                             const google::protobuf::RepeatedPtrField<std::string>& labels) {
  MarkerSet all;
  std::map<std::string, std::size_t> rows;
  for (const auto& marker : message.markers()) {
    const auto field = indexed("marker_set.markers", all.markers.size());
    all.markers.push_back(markerFromProto(marker, field));
    if (!rows.emplace(marker.label(), all.markers.size() - 1).second)
      throw InvalidInput(field + ".label", "\"" + marker.label() + "\" stands twice");
  }
  if (labels.empty()) return all;
  MarkerSet chosen;
  for (const auto& label : labels) {
    const auto field = indexed("labels", chosen.markers.size());
    const auto found = rows.find(label);
    if (found == rows.end())
      throw InvalidInput(field, "\"" + label + "\" is unknown: it is no label of the marker set, or stands twice");
    chosen.markers.push_back(all.markers[found->second]);
    rows.erase(found);
  }
  return chosen;
}

Vertices markersFromProto(const v1::MarkerFrame& frame, Eigen::Index count, const std::string& field) {
  auto markers = pointsFromProto(frame.positions(), count, field + ".positions");
  for (Eigen::Index i = 0; i < count; ++i) {
    if (markers.row(i).array().isInf().any())
      throw InvalidInput(field + ".positions", "marker " + std::to_string(i) + " has an infinite coordinate");
    if (markers.row(i).array().isNaN().any()) markers.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return markers;
}

}  // namespace shaped::server
