#pragma once

#include "server/convert/limits.h"
#include "server/datasets/dataset_store.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::server {

class ShapesService final : public v1::Shapes::CallbackService {
 public:
  ShapesService(Runtime& runtime, const Limits& limits, ModelStore& models, DatasetStore& datasets)
      : runtime_(runtime), limits_(limits), models_(models), datasets_(datasets) {}

  grpc::ServerUnaryReactor* Project(grpc::CallbackServerContext* context, const v1::ProjectRequest* request,
                                    v1::ProjectResponse* response) override;
  grpc::ServerUnaryReactor* Synthesize(grpc::CallbackServerContext* context, const v1::SynthesizeRequest* request,
                                       v1::SynthesizeResponse* response) override;
  grpc::ServerWriteReactor<v1::InterpolateResponse>* Interpolate(grpc::CallbackServerContext* context,
                                                                 const v1::InterpolateRequest* request) override;
  grpc::ServerUnaryReactor* Edit(grpc::CallbackServerContext* context, const v1::EditRequest* request,
                                 v1::EditResponse* response) override;
  grpc::ServerBidiReactor<v1::FitMarkersRequest, v1::FitMarkersResponse>* FitMarkers(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* Score(grpc::CallbackServerContext* context, const v1::ScoreRequest* request,
                                  v1::ScoreResponse* response) override;
  grpc::ServerUnaryReactor* Evaluate(grpc::CallbackServerContext* context, const v1::EvaluateRequest* request,
                                     v1::EvaluateResponse* response) override;

 private:
  Runtime& runtime_;
  const Limits& limits_;
  ModelStore& models_;
  DatasetStore& datasets_;
};

}  // namespace shaped::server
