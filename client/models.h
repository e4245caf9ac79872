#pragma once

#include "client/connection.h"
#include "core/mesh/types.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::client {

/// A model as a client needs it to read and write meshes.
struct ModelMesh {
  v1::ModelDescription description;
  Vertices mean;  ///< V x 3 [m]
  Faces faces;    ///< F x 3
};

/// Throws RpcError when there is no such model. The answer's version pins further requests to the same model.
ModelMesh getModelMesh(const std::shared_ptr<grpc::Channel>& channel, const v1::ModelSelector& model,
                       const CallOptions& options);

/// The selector of exactly this model.
v1::ModelSelector pinned(const v1::ModelDescription& description);

}  // namespace shaped::client
