#include "client/models.h"

#include "client/mesh.h"

namespace shaped::client {

ModelMesh getModelMesh(const std::shared_ptr<grpc::Channel>& channel, const v1::ModelSelector& model,
                       const CallOptions& options) {
  Call call(options);
  v1::GetModelRequest request;
  *request.mutable_model() = model;
  request.set_with_mean(true);
  v1::GetModelResponse response;
  require(v1::Models::NewStub(channel)->Get(call.context(), request, &response));
  return {response.description(), unpack(response.mean().positions()), unpack(response.mean().faces())};
}

v1::ModelSelector pinned(const v1::ModelDescription& description) {
  v1::ModelSelector selector;
  selector.set_name(description.model().name());
  selector.set_version(description.model().version());
  return selector;
}

}  // namespace shaped::client
