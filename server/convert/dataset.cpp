#include "server/convert/dataset.h"

#include "server/convert/time.h"

namespace shaped::server {

void toProto(const DatasetInfo& info, v1::Dataset& dataset) {
  dataset.set_name(info.name);
  dataset.set_frames(static_cast<std::uint32_t>(info.frames));
  dataset.set_vertex_count(static_cast<std::uint32_t>(info.vertex_count));
  dataset.set_face_count(static_cast<std::uint32_t>(info.face_count));
  dataset.set_topology_id(info.topology_id);
  toProto(info.created, *dataset.mutable_created());
}

}  // namespace shaped::server
