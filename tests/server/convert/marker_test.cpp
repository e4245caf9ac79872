#include "server/convert/marker.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

v1::MarkerSet threeMarkers() {
  v1::MarkerSet set;
  for (const auto* label : {"A", "B", "C"}) {
    set.add_markers()->set_label(label);
    set.mutable_markers(set.markers_size() - 1)->set_vertex(static_cast<std::uint32_t>(set.markers_size()));
  }
  auto& point = *set.mutable_markers(2)->mutable_point();
  point.set_face(7);
  for (const double weight : {0.2, 0.3, 0.5}) point.add_barycentric(weight);
  for (const double offset : {0.01, 0.0, 0.02}) set.mutable_markers(1)->add_offset(offset);
  return set;
}

google::protobuf::RepeatedPtrField<std::string> labels(std::initializer_list<const char*> list) {
  google::protobuf::RepeatedPtrField<std::string> field;
  for (const auto* label : list) *field.Add() = label;
  return field;
}

}  // namespace

TEST_CASE("a marker set is read, in its own order or in that of the labels") {
  const auto set = markerSetFromProto(threeMarkers(), {});
  REQUIRE(set.markers.size() == 3);
  CHECK(set.markers[0].vertex == 1);
  CHECK(set.markers[1].offset.z() == 0.02);
  CHECK(set.markers[2].vertex == -1);
  CHECK(set.markers[2].face == 7);
  CHECK(set.markers[2].barycentric.y() == 0.3);
  const auto chosen = markerSetFromProto(threeMarkers(), labels({"C", "A"}));
  REQUIRE(chosen.markers.size() == 2);
  CHECK(chosen.markers[0].label == "C");
  CHECK(chosen.markers[1].label == "A");
}

TEST_CASE("a faulty marker set is refused by marker") {
  const auto refused = [](auto&& change, const std::string& text) {
    auto set = threeMarkers();
    change(set);
    CHECK_THROWS_WITH(markerSetFromProto(set, {}), Contains(text));
  };
  refused([](auto& set) { set.mutable_markers(1)->clear_label(); }, "marker_set.markers[1].label: is empty");
  refused([](auto& set) { set.mutable_markers(1)->set_label("A"); }, "marker_set.markers[1].label: \"A\" stands twice");
  refused([](auto& set) { set.mutable_markers(0)->clear_place(); }, "marker_set.markers[0].place: is missing");
  refused([](auto& set) { set.mutable_markers(2)->mutable_point()->add_barycentric(0); },
          "marker_set.markers[2].point.barycentric: has 4 numbers");
  refused([](auto& set) { set.mutable_markers(1)->set_offset(1, std::nan("")); },
          "marker_set.markers[1].offset: has a number that is not finite");
  CHECK_THROWS_WITH(markerSetFromProto(threeMarkers(), labels({"A", "Z"})), Contains("labels[1]: \"Z\" is unknown"));
  CHECK_THROWS_WITH(markerSetFromProto(threeMarkers(), labels({"A", "A"})), Contains("labels[1]: \"A\" is unknown"));
}

TEST_CASE("a marker with one NaN is missing altogether") {
  v1::MarkerFrame frame;
  for (const float x : {1.F, 2.F, 3.F, 4.F, std::numeric_limits<float>::quiet_NaN(), 6.F}) frame.add_positions(x);
  const auto markers = markersFromProto(frame, 2);
  CHECK(markers.row(0) == Eigen::RowVector3d(1, 2, 3));
  CHECK(markers.row(1).array().isNaN().all());
  CHECK_THROWS_WITH(markersFromProto(frame, 3), Contains("frame.positions: has 6 numbers, want 9"));
  frame.set_positions(0, std::numeric_limits<float>::infinity());
  CHECK_THROWS_WITH(markersFromProto(frame, 2), Contains("marker 0 has an infinite"));
}
