#include "core/io/marker_set_file.h"

#include <catch2/catch.hpp>

#include "core/io/c3d.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

MarkerSet parse(const std::string& markers, const std::string& more = "") {
  return parseMarkerSet("m.json", "{\"markers\": [" + markers + "]" + more + "}", 100, 50);
}

MarkerSet labelled(std::initializer_list<const char*> labels) {
  MarkerSet set;
  for (const char* label : labels) {
    auto& marker = set.markers.emplace_back();
    marker.label = label;
    marker.vertex = 1;
  }
  return set;
}

}  // namespace

TEST_CASE("a marker set reads vertices, points of faces and offsets") {
  const auto set = parse(R"({"label": "A", "vertex": 99, "offset": [0.1, 0, -1e-3], "note": "left"},
                            {"label": "B", "face": 49, "barycentric": [0.2, 0.3, 0.5]})");
  REQUIRE(set.markers.size() == 2);
  CHECK(set.markers[0].label == "A");
  CHECK(set.markers[0].vertex == 99);
  CHECK(set.markers[0].face == -1);
  CHECK(set.markers[0].offset == Eigen::Vector3d(0.1, 0, -1e-3));
  CHECK(set.markers[1].vertex == -1);
  CHECK(set.markers[1].face == 49);
  CHECK(set.markers[1].barycentric == Eigen::Vector3d(0.2, 0.3, 0.5));
  CHECK(set.markers[1].offset == Eigen::Vector3d::Zero());
}

TEST_CASE("a marker set reads back what was written") {
  const test::TemporaryFolder folder;
  const auto set = parse(R"({"label": "A", "vertex": 99, "offset": [0.1, 0, -1e-3]},
                            {"label": "B", "face": 49, "barycentric": [0.3333333333333333, 0.3333333333333333, 0.3333333333333334]})");
  writeMarkerSet(folder / "m.json", set);
  const auto back = readMarkerSet(folder / "m.json", 100, 50);
  REQUIRE(back.markers.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(back.markers[i].label == set.markers[i].label);
    CHECK(back.markers[i].vertex == set.markers[i].vertex);
    CHECK(back.markers[i].face == set.markers[i].face);
    CHECK(back.markers[i].barycentric == set.markers[i].barycentric);
    CHECK(back.markers[i].offset == set.markers[i].offset);
  }
}

TEST_CASE("a marker set for several templates takes the vertices of the one with this vertex count") {
  const std::string markers =
      R"({"label": "A", "vertex_full": 7000, "vertex_1k": 12, "real_marker_offset_m": [0, 0, 0.009]})";
  const std::string topologies = R"(, "topology_full": 9000, "topology_1k": 100)";
  const auto set = parse(markers, topologies);
  CHECK(set.markers[0].vertex == 12);
  CHECK(set.markers[0].offset == Eigen::Vector3d(0, 0, 0.009));
  CHECK_THROWS_WITH(parse(markers, R"(, "topology_full": 9000)"),
                    Contains("m.json: markers[0] ('A') has no place") && Contains("for a template of 100 vertices"));
}

TEST_CASE("faulty marker sets are refused with the file, the marker and the reason") {
  struct Case {
    std::string markers, error;
  };
  const std::vector<Case> cases{
      {"", "has no markers"},
      {"3", "markers[0] has no label"},
      {R"({"vertex": 3})", "markers[0] has no label"},
      {R"({"label": "", "vertex": 3})", "markers[0] has no label"},
      {R"({"label": 7, "vertex": 3})", "markers[0] has no label"},
      {R"({"label": "A", "vertex": 3}, {"label": "A", "vertex": 4})", "markers[1] ('A') has a label that an earlier"},
      {R"({"label": "A"})", "markers[0] ('A') has no place"},
      {R"({"label": "A", "vertex": 100})", "markers[0] ('A') has vertex 100, outside [0, 100)"},
      {R"({"label": "A", "vertex": -1})", "markers[0] ('A') has vertex -1, outside [0, 100)"},
      {R"({"label": "A", "vertex": 18446744073709551615})",
       "markers[0] ('A') has vertex 18446744073709551615, outside"},
      {R"({"label": "A", "vertex": 1.5})", "markers[0] ('A') has a vertex that is no whole number"},
      {R"({"label": "A", "vertex": 1, "face": 2})", "markers[0] ('A') has both a vertex and a face"},
      {R"({"label": "A", "face": 2})", "markers[0] ('A') has a face without barycentric weights"},
      {R"({"label": "A", "face": 50, "barycentric": [1, 0, 0]})", "markers[0] ('A') has face 50, outside [0, 50)"},
      {R"({"label": "A", "face": 2, "barycentric": [1, 0]})", "markers[0] ('A') needs three numbers as barycentric"},
      {R"({"label": "A", "face": 2, "barycentric": [1, 1, 0]})", "markers[0] ('A') has barycentric weights"},
      {R"({"label": "A", "face": 2, "barycentric": [2, -1, 0]})", "markers[0] ('A') has barycentric weights"},
      {R"({"label": "A", "vertex": 2, "offset": 0.01})", "markers[0] ('A') needs three numbers as offset"}};
  for (const auto& [markers, error] : cases) {
    INFO(markers);
    CHECK_THROWS_AS(parse(markers), InvalidInput);
    CHECK_THROWS_WITH(parse(markers), Contains("m.json: " + error));
  }
  for (const std::string text : {"", "{", "[]", "{\"markers\": {}}", "\xff"})
    CHECK_THROWS_AS(parseMarkerSet("m.json", text, 100, 50), InvalidInput);
}

TEST_CASE("markers find their labels in a trial, with or without the subject's name") {
  const std::vector<std::string> labels{"Anna:B", "Anna:A", "C", "Anna:C", "D"};
  CHECK(matchLabels(labelled({"A", "B", "C", "Anna:C"}), labels) == std::vector<std::int32_t>{1, 0, 2, 3});
  CHECK_THROWS_WITH(matchLabels(labelled({"A", "X", "B", "Y", "C"}), labels),
                    Contains("markers: the trial has no 'X', 'Y'; its labels are 'Anna:B', 'Anna:A'"));
  CHECK(matchLabels(labelled({"A", "X", "B", "D"}), labels, true) == std::vector<std::int32_t>{1, -1, 0, 4});
  CHECK_THROWS_WITH(matchLabels(labelled({"A", "X", "B"}), labels, true),
                    Contains("only 2 of 3 markers are in the trial"));
  CHECK_THROWS_AS(matchLabels(labelled({"A"}), {}), InvalidInput);
  const std::vector<std::string> two{"Anna:A", "Otto:A", "B", "C"};
  CHECK_THROWS_WITH(matchLabels(labelled({"A", "B", "C"}), two),
                    Contains("'A' matches two labels of the trial, 'Anna:A' and 'Otto:A'"));
  CHECK(matchLabels(labelled({"Otto:A", "B", "C"}), two) == std::vector<std::int32_t>{1, 2, 3});
}

TEST_CASE("the real marker set fits both templates and the real trial") {
  const auto found = test::realData("marker_trials/marker_sets/cmu41.json");
  if (!found) return;
  const auto full = readMarkerSet(*found, 13380, 26756), coarse = readMarkerSet(*found, 1250, 2496);
  REQUIRE(full.markers.size() == 41);
  REQUIRE(coarse.markers.size() == 41);
  CHECK(full.markers[0].label == "LFWT");
  CHECK(full.markers[0].vertex == 10947);
  CHECK(coarse.markers[0].vertex == 968);
  CHECK(coarse.markers[0].offset == Eigen::Vector3d(0.0054, 0.0002, 0.0072));
  CHECK_THROWS_WITH(readMarkerSet(*found, 500, 900), Contains("has no place"));
  if (const auto trial = test::realData("cmu_mocap/c3d/85_02.c3d")) {
    const auto columns = matchLabels(full, readC3d(*trial).labels);
    for (std::int32_t i = 0; i < 41; ++i) CHECK(columns[static_cast<std::size_t>(i)] == i);
  }
}
