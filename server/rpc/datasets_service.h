#pragma once

#include "server/convert/limits.h"
#include "server/datasets/dataset_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/datasets.grpc.pb.h"

namespace shaped::server {

class DatasetsService final : public v1::Datasets::CallbackService {
 public:
  DatasetsService(Runtime& runtime, const Limits& limits, DatasetStore& store)
      : runtime_(runtime), limits_(limits), store_(store) {}

  grpc::ServerReadReactor<v1::UploadDatasetRequest>* Upload(grpc::CallbackServerContext* context,
                                                            v1::UploadDatasetResponse* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context, const v1::ListDatasetsRequest* request,
                                 v1::ListDatasetsResponse* response) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context, const v1::DeleteDatasetRequest* request,
                                   v1::DeleteDatasetResponse* response) override;

 private:
  Runtime& runtime_;
  const Limits& limits_;
  DatasetStore& store_;
};

}  // namespace shaped::server
