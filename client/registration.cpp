#include "client/registration.h"

#include <exception>
#include <thread>

#include "client/mesh.h"

namespace shaped::client {
namespace {

using Frame = v1::RegisterSequenceRequest::Frame;
using Stream = grpc::ClientReaderWriter<v1::RegisterSequenceRequest, v1::RegisterResponse>;

void sendAll(Stream& stream, const v1::RegisterSequenceRequest::Setup& setup, std::int64_t count,
             const std::function<Frame(std::int64_t)>& frame) {
  v1::RegisterSequenceRequest message;
  *message.mutable_setup() = setup;
  // A failed write means that the daemon has ended the stream: the reader hears why.
  bool open = stream.Write(message);
  for (std::int64_t i = 0; i < count && open; ++i) {
    *message.mutable_frame() = frame(i);
    open = stream.Write(message);
  }
  stream.WritesDone();
}

}  // namespace

v1::Scan pack(const Scan& scan) {
  v1::Scan packed;
  pack(scan.points, *packed.mutable_positions());
  pack(scan.normals, *packed.mutable_normals());
  pack(scan.faces, *packed.mutable_faces());
  return packed;
}

v1::RegisterResponse registerScan(const std::shared_ptr<grpc::Channel>& channel, const v1::RegisterRequest& request,
                                  const CallOptions& options) {
  Call call(options);
  v1::RegisterResponse response;
  require(v1::Registration::NewStub(channel)->Register(call.context(), request, &response));
  return response;
}

void registerSequence(const std::shared_ptr<grpc::Channel>& channel, const v1::RegisterSequenceRequest::Setup& setup,
                      std::int64_t count, const std::function<Frame(std::int64_t index)>& frame,
                      const CallOptions& options, const std::function<void(const v1::RegisterResponse&)>& answer) {
  const auto stub = v1::Registration::NewStub(channel);
  Call call(options);
  const auto stream = stub->RegisterSequence(call.context());
  std::exception_ptr failure;  // of the sender, read once it has ended
  std::thread sender([&] {
    try {
      sendAll(*stream, setup, count, frame);
    } catch (...) {
      failure = std::current_exception();
      call.context()->TryCancel();
    }
  });
  try {
    for (v1::RegisterResponse response; stream->Read(&response);) answer(response);
  } catch (...) {
    call.context()->TryCancel();
    sender.join();
    stream->Finish();
    throw;
  }
  sender.join();
  const auto status = stream->Finish();
  if (failure) std::rethrow_exception(failure);
  require(status);
}

}  // namespace shaped::client
