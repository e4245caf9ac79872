#pragma once

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/registration.grpc.pb.h"

namespace shaped::server {

class RegistrationService final : public v1::Registration::CallbackService {
 public:
  RegistrationService(Runtime& runtime, const Limits& limits, ModelStore& models)
      : runtime_(runtime), limits_(limits), models_(models) {}

  grpc::ServerUnaryReactor* Register(grpc::CallbackServerContext* context, const v1::RegisterRequest* request,
                                     v1::RegisterResponse* response) override;
  grpc::ServerBidiReactor<v1::RegisterSequenceRequest, v1::RegisterResponse>* RegisterSequence(
      grpc::CallbackServerContext* context) override;
  grpc::ServerBidiReactor<v1::EstimateUnderClothingRequest, v1::EstimateUnderClothingResponse>* EstimateUnderClothing(
      grpc::CallbackServerContext* context) override;

 private:
  Runtime& runtime_;
  const Limits& limits_;
  ModelStore& models_;
};

}  // namespace shaped::server
