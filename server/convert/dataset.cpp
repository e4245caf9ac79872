#include "server/convert/dataset.h"

#include "core/numerics/error.h"
#include "server/convert/time.h"

namespace shaped::server {

DatasetKind kindFromProto(v1::DatasetKind kind, const std::string& field) {
  if (!v1::DatasetKind_IsValid(kind)) throw InvalidInput(field, std::to_string(kind) + " is no DatasetKind");
  return kind == v1::DATASET_KIND_SCANS ? DatasetKind::kScans : DatasetKind::kShapes;
}

void toProto(const DatasetInfo& info, v1::Dataset& dataset) {
  dataset.set_name(info.name);
  dataset.set_kind(info.kind == DatasetKind::kScans ? v1::DATASET_KIND_SCANS : v1::DATASET_KIND_SHAPES);
  dataset.set_frames(static_cast<std::uint32_t>(info.frames));
  dataset.set_vertex_count(static_cast<std::uint32_t>(info.vertex_count));
  dataset.set_face_count(static_cast<std::uint32_t>(info.face_count));
  dataset.set_topology_id(info.topology_id);
  toProto(info.created, *dataset.mutable_created());
}

}  // namespace shaped::server
