#include "server/convert/scan.h"

#include <cmath>

#include "core/numerics/error.h"
#include "server/convert/mesh.h"

namespace shaped::server {
namespace {

Eigen::Vector3d threeNumbers(const google::protobuf::RepeatedField<double>& numbers, const std::string& field) {
  if (numbers.size() != 3) throw InvalidInput(field, "has " + std::to_string(numbers.size()) + " numbers, want three");
  const Eigen::Vector3d vector(numbers[0], numbers[1], numbers[2]);
  if (!vector.allFinite()) throw InvalidInput(field, "has a number that is not finite");
  return vector;
}

void requireIndex(std::uint32_t index, Eigen::Index count, const std::string& field) {
  if (index >= static_cast<std::uint64_t>(count))
    throw InvalidInput(field, "= " + std::to_string(index) + " is outside [0, " + std::to_string(count) + ")");
}

/// A face at each vertex, and which of its corners that is.
class Corners {
 public:
  explicit Corners(const Topology& topology) : at_(static_cast<std::size_t>(topology.vertexCount())) {
    const auto& faces = topology.faces();
    for (std::int32_t f = 0; f < faces.rows(); ++f)
      for (int c = 0; c < 3; ++c) at_[static_cast<std::size_t>(faces(f, c))] = {f, c};
  }
  Anchor anchor(std::uint32_t vertex) const {
    Anchor anchor;
    anchor.face = at_[vertex].first;
    anchor.barycentric = Eigen::Vector3d::Unit(at_[vertex].second);
    return anchor;
  }

 private:
  std::vector<std::pair<std::int32_t, int>> at_;
};

Anchor pointFromProto(const v1::MarkerSet::FacePoint& message, const Topology& topology, const std::string& field) {
  requireIndex(message.face(), topology.faces().rows(), field + ".face");
  Anchor anchor;
  anchor.face = static_cast<std::int32_t>(message.face());
  anchor.barycentric = threeNumbers(message.barycentric(), field + ".barycentric");
  if (anchor.barycentric.minCoeff() < 0 || std::abs(anchor.barycentric.sum() - 1) > 1e-6)
    throw InvalidInput(field + ".barycentric", "want three weights >= 0 with sum 1");
  return anchor;
}

}  // namespace

Scan scanFromProto(const v1::Scan& message, const Limits& limits, const std::string& field) {
  const std::int64_t count = message.positions_size() / 3;
  requireAtMost(count, limits.vertices, field + ".positions", "points");
  Scan scan;
  scan.points = pointsFromProto(message.positions(), count, field + ".positions");
  if (!message.normals().empty()) scan.normals = pointsFromProto(message.normals(), count, field + ".normals");
  if (!message.faces().empty()) scan.faces = facesFromProto(message.faces(), count, limits, field + ".faces");
  return scan;
}

std::vector<Landmark> landmarksFromProto(const google::protobuf::RepeatedPtrField<v1::ScanLandmark>& messages,
                                         const Topology& topology, double unit_factor, const Limits& limits,
                                         const std::string& list) {
  requireAtMost(messages.size(), limits.markers, list, "landmarks");
  std::vector<Landmark> landmarks;
  if (messages.empty()) return landmarks;
  const Corners corners(topology);
  for (const auto& message : messages) {
    const auto field = list + "[" + std::to_string(landmarks.size()) + "]";
    Landmark landmark;
    if (message.has_vertex()) {
      requireIndex(message.vertex(), topology.vertexCount(), field + ".vertex");
      landmark.anchor = corners.anchor(message.vertex());
    } else if (message.has_point()) {
      landmark.anchor = pointFromProto(message.point(), topology, field + ".point");
    } else {
      throw InvalidInput(field + ".place", "is missing: name a vertex or a point of a face");
    }
    landmark.position = unit_factor * threeNumbers(message.position(), field + ".position");
    if (message.has_weight()) landmark.weight = message.weight();
    if (!(landmark.weight >= 0) || !std::isfinite(landmark.weight))
      throw InvalidInput(field + ".weight", "= " + std::to_string(landmark.weight) + ", want >= 0");
    landmarks.push_back(landmark);
  }
  return landmarks;
}

ScanRegistrationOptions registrationOptionsFromProto(const v1::RegistrationOptions& message, std::stop_token stop) {
  ScanRegistrationOptions options;
  if (message.unit_factor() != 0) options.unit_factor = message.unit_factor();
  if (message.has_landmark_weight()) options.fit.landmark_weight = message.landmark_weight();
  options.refine = message.refine();
  options.stop = std::move(stop);
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  return options;
}

void toProto(const ModelFitReport& report, v1::ScanReport& message) {
  message.set_scan_median(report.scan_median);
  message.set_scan_mean(report.scan_mean);
  message.set_scan_95(report.scan_95);
  message.set_model_mean(report.model_mean);
  message.set_explained(report.explained);
  message.set_seen(report.seen);
  message.set_chamfer(report.chamfer);
  for (const auto& region : report.regions) {
    auto& added = *message.add_regions();
    added.set_name(region.name);
    added.set_seen(region.seen);
    added.set_mean_distance(region.mean_distance);
  }
}

void toProto(const FittingReport& report, v1::RefinementReport& message) {
  message.set_median_distance(report.median_distance);
  message.set_percentile_95_distance(report.percentile_95_distance);
  message.set_gated_out(report.gated_out);
  message.set_smallest_area_ratio(report.smallest_area_ratio);
  message.set_flipped(static_cast<std::uint32_t>(report.flipped));
}

}  // namespace shaped::server
