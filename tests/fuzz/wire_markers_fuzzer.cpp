#include "core/model/shell_pga_model.h"
#include "server/convert/marker.h"
#include "shaped/v1/shapes.pb.h"
#include "tests/fuzz/small_model.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

void requireFrame(const Vertices& frame) {
  for (const auto& row : frame.rowwise())
    require(row.allFinite() || row.array().isNaN().all(), "a marker is finite or missing");
}

void convertSetup(const v1::FitMarkersRequest::Setup& setup) {
  const auto markers =
      accepted<InvalidInput>([&] { return server::markerSetFromProto(setup.marker_set(), setup.labels()); });
  if (!markers) return;
  const int count = setup.labels().empty() ? setup.marker_set().markers_size() : setup.labels_size();
  require(std::ssize(markers->markers) == count, "there is a marker for every label");
  for (const auto& message : setup.calibration())
    if (const auto frame = accepted<InvalidInput>([&] { return server::markersFromProto(message, count); }))
      requireFrame(*frame);
  const auto sites = accepted<InvalidInput>([&] { return smallModel()->sitesOf(*markers); });
  if (!sites) return;
  for (const auto& site : *sites) {
    require(site.skin.barycentric.allFinite() && site.offset.allFinite(), "sites are finite");
    require(site.skin.face >= 0 && site.skin.face < 20, "sites are on the coarse mesh");
  }
}

}  // namespace

FUZZ_WIRE_TARGET(wire_markers, shaped::v1::FitMarkersRequest) {
  const auto message = parsed<v1::FitMarkersRequest>(bytes);
  if (!message) return;
  if (message->has_setup()) convertSetup(message->setup());
  const auto frame = accepted<InvalidInput>([&] { return server::markersFromProto(message->frame(), 3); });
  if (frame) requireFrame(*frame);
}
