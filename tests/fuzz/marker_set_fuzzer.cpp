#include <set>

#include "core/io/marker_set_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

constexpr std::int32_t kVertices = 100, kFaces = 50;

void requireMarkers(const MarkerSet& set) {
  std::set<std::string> labels;
  for (const auto& marker : set.markers) {
    require(!marker.label.empty() && labels.insert(marker.label).second, "labels are unique");
    require(marker.vertex < kVertices && marker.face < kFaces, "places are on the template");
    require((marker.vertex >= 0) != (marker.face >= 0), "a marker is at a vertex or on a face");
    require(marker.offset.allFinite() && marker.barycentric.allFinite(), "numbers are finite");
    if (marker.face >= 0) require(std::abs(marker.barycentric.sum() - 1) < 1e-5, "weights sum to 1");
  }
}

}  // namespace

FUZZ_TARGET(marker_set) {
  const auto set = accepted<InvalidInput>([&] { return parseMarkerSet("markers.json", bytes, kVertices, kFaces); });
  if (!set) return;
  requireMarkers(*set);
  const auto file = scratchFolder() / "markers.json";
  writeMarkerSet(file, *set);
  const auto back = readMarkerSet(file, kVertices, kFaces);
  require(back.markers.size() == set->markers.size(), "markers survive");
  for (std::size_t i = 0; i < back.markers.size(); ++i) {
    const auto &one = set->markers[i], &other = back.markers[i];
    require(one.label == other.label && one.vertex == other.vertex && one.face == other.face, "places survive");
    require(one.offset == other.offset && one.barycentric == other.barycentric, "numbers survive");
  }
}
