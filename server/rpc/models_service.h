#pragma once

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::server {

class ModelsService final : public v1::Models::CallbackService {
 public:
  ModelsService(Runtime& runtime, const Limits& limits, ModelStore& store)
      : runtime_(runtime), limits_(limits), store_(store) {}

  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context, const v1::ListModelsRequest* request,
                                 v1::ListModelsResponse* response) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context, const v1::GetModelRequest* request,
                                v1::GetModelResponse* response) override;
  grpc::ServerUnaryReactor* Load(grpc::CallbackServerContext* context, const v1::LoadModelRequest* request,
                                 v1::LoadModelResponse* response) override;
  grpc::ServerUnaryReactor* Unload(grpc::CallbackServerContext* context, const v1::UnloadModelRequest* request,
                                   v1::UnloadModelResponse* response) override;
  grpc::ServerUnaryReactor* WaitUntilReady(grpc::CallbackServerContext* context,
                                           const v1::WaitUntilReadyRequest* request,
                                           v1::WaitUntilReadyResponse* response) override;
  grpc::ServerUnaryReactor* SetLabel(grpc::CallbackServerContext* context, const v1::SetLabelRequest* request,
                                     v1::SetLabelResponse* response) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context, const v1::DeleteModelRequest* request,
                                   v1::DeleteModelResponse* response) override;
  grpc::ServerWriteReactor<v1::DownloadModelResponse>* Download(grpc::CallbackServerContext* context,
                                                                const v1::DownloadModelRequest* request) override;
  grpc::ServerReadReactor<v1::UploadModelRequest>* Upload(grpc::CallbackServerContext* context,
                                                          v1::UploadModelResponse* response) override;

 private:
  Runtime& runtime_;
  const Limits& limits_;
  ModelStore& store_;
};

}  // namespace shaped::server
