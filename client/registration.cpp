#include "client/registration.h"

#include "client/mesh.h"
#include "client/two_way_stream.h"

namespace shaped::client {

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
                      std::int64_t count,
                      const std::function<v1::RegisterSequenceRequest::Frame(std::int64_t index)>& frame,
                      const CallOptions& options, const std::function<void(const v1::RegisterResponse&)>& answer) {
  const auto stub = v1::Registration::NewStub(channel);
  Call call(options);
  const auto stream = stub->RegisterSequence(call.context());
  converse(call, *stream, setup, count, frame, answer);
}

void estimateUnderClothing(const std::shared_ptr<grpc::Channel>& channel,
                           const v1::EstimateUnderClothingRequest::Setup& setup, std::int64_t count,
                           const std::function<v1::EstimateUnderClothingRequest::Frame(std::int64_t index)>& frame,
                           const CallOptions& options,
                           const std::function<void(const v1::EstimateUnderClothingResponse&)>& answer) {
  const auto stub = v1::Registration::NewStub(channel);
  Call call(options);
  const auto stream = stub->EstimateUnderClothing(call.context());
  converse(call, *stream, setup, count, frame, answer);
}

}  // namespace shaped::client
