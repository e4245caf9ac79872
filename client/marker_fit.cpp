#include "client/marker_fit.h"

#include "client/mesh.h"
#include "client/two_way_stream.h"

namespace shaped::client {

v1::MarkerFrame packFrame(const MarkerFrames& frames, std::int64_t number) {
  v1::MarkerFrame frame;
  frame.set_frame(static_cast<std::uint32_t>(number));
  pack(frames.positions(number), *frame.mutable_positions());
  return frame;
}

v1::MarkerSet pack(const MarkerSet& set) {
  v1::MarkerSet packed;
  for (const auto& marker : set.markers) {
    auto& target = *packed.add_markers();
    target.set_label(marker.label);
    if (marker.vertex >= 0) {
      target.set_vertex(static_cast<std::uint32_t>(marker.vertex));
    } else {
      target.mutable_point()->set_face(static_cast<std::uint32_t>(marker.face));
      for (const double weight : marker.barycentric) target.mutable_point()->add_barycentric(weight);
    }
    for (const double coordinate : marker.offset) target.add_offset(coordinate);
  }
  return packed;
}

void fitMarkers(const std::shared_ptr<grpc::Channel>& channel, const v1::FitMarkersRequest::Setup& setup,
                const MarkerFrames& frames, const CallOptions& options,
                const std::function<void(const v1::FitMarkersResponse&)>& answer) {
  const auto stub = v1::Shapes::NewStub(channel);
  Call call(options);
  const auto stream = stub->FitMarkers(call.context());
  const auto frame = [&](std::int64_t index) {
    return packFrame(frames, frames.numbers[static_cast<std::size_t>(index)]);
  };
  converse(call, *stream, setup, std::ssize(frames.numbers), frame, answer);
}

}  // namespace shaped::client
