#include "server/convert/scan.h"
#include "tests/fuzz/small_model.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_WIRE_TARGET(wire_scan, shaped::v1::RegisterRequest) {
  const auto message = parsed<v1::RegisterRequest>(bytes);
  if (!message) return;
  if (const auto scan = accepted<InvalidInput>([&] { return server::scanFromProto(message->scan(), {}); })) {
    require(scan->points.rows() == message->scan().positions_size() / 3, "a scan keeps its points");
    require(scan->normals.rows() == 0 || scan->normals.rows() == scan->points.rows(), "normals are one a point");
    if (scan->faces.rows() > 0)
      require(scan->faces.minCoeff() >= 0 && scan->faces.maxCoeff() < scan->points.rows(), "corners are points");
  }
  const auto options =
      accepted<InvalidInput>([&] { return server::registrationOptionsFromProto(message->options(), {}); });
  if (options) require(options->unit_factor > 0, "a unit is positive");
  const auto& topology = *smallBody().topology();
  const auto landmarks =
      accepted<InvalidInput>([&] { return server::landmarksFromProto(message->landmarks(), topology, 1, {}); });
  if (!landmarks) return;
  for (const auto& landmark : *landmarks) {
    require(landmark.anchor.face >= 0 && landmark.anchor.face < topology.faces().rows(), "landmarks are on faces");
    require(landmark.anchor.barycentric.minCoeff() >= 0 && landmark.position.allFinite() && landmark.weight >= 0,
            "landmarks are finite");
  }
}
