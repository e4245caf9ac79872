#include "server/convert/mesh.h"
#include "server/datasets/name.h"
#include "shaped/v1/datasets.pb.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

void convertHeader(const v1::UploadDatasetRequest::Header& header) {
  accepted<InvalidInput>([&] { return server::requireName(header.name(), "name"), true; });
  const auto faces = accepted<InvalidInput>(
      [&] { return server::facesFromProto(header.faces(), header.vertex_count(), {}, "faces"); });
  if (!faces) return;
  require(faces->minCoeff() >= 0 && static_cast<std::uint32_t>(faces->maxCoeff()) < header.vertex_count(),
          "corners are vertices");
  const auto topology =
      accepted<InvalidInput>([&] { return Topology(static_cast<std::int32_t>(header.vertex_count()), *faces); });
  if (!topology) return;
  require(topology->faces() == *faces, "the topology keeps the faces");
  accepted<InvalidInput>(
      [&] { return server::pointsFromProto(header.template_positions(), topology->vertexCount(), "template"); });
}

}  // namespace

FUZZ_WIRE_TARGET(wire_dataset, shaped::v1::UploadDatasetRequest) {
  const auto message = parsed<v1::UploadDatasetRequest>(bytes);
  if (!message) return;
  if (message->has_header()) convertHeader(message->header());
  const auto points =
      accepted<InvalidInput>([&] { return server::pointsFromProto(message->frame().positions(), 4, "frame"); });
  if (points) require(points->rows() == 4, "a frame has a row for every vertex");
}
