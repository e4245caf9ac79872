#include "client/marker_fit.h"

#include <thread>

#include "client/mesh.h"

namespace shaped::client {
namespace {

using Stream = grpc::ClientReaderWriter<v1::FitMarkersRequest, v1::FitMarkersResponse>;

void sendAll(Stream& stream, const v1::FitMarkersRequest::Setup& setup, const MarkerFrames& frames) {
  v1::FitMarkersRequest message;
  *message.mutable_setup() = setup;
  // A failed write means that the daemon has ended the stream: the reader hears why.
  bool open = stream.Write(message);
  for (const auto number : frames.numbers) {
    if (!open) break;
    *message.mutable_frame() = packFrame(frames, number);
    open = stream.Write(message);
  }
  stream.WritesDone();
}

}  // namespace

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
  std::thread sender([&] { sendAll(*stream, setup, frames); });
  try {
    for (v1::FitMarkersResponse response; stream->Read(&response);) answer(response);
  } catch (...) {
    call.context()->TryCancel();
    sender.join();
    stream->Finish();
    throw;
  }
  sender.join();
  require(stream->Finish());
}

}  // namespace shaped::client
