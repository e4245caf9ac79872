#include "server/rpc/registration_service.h"

#include "server/rpc/estimate_under_clothing.h"
#include "server/rpc/register_scan.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {

grpc::ServerUnaryReactor* RegistrationService::Register(grpc::CallbackServerContext* context,
                                                        const v1::RegisterRequest* request,
                                                        v1::RegisterResponse* response) {
  return startUnary<v1::RegisterRequest, v1::RegisterResponse>(
      runtime_, runtime_.pool, "Registration.Register", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) { registerOne(models_, limits_, wanted, answer, call); });
}

grpc::ServerBidiReactor<v1::RegisterSequenceRequest, v1::RegisterResponse>* RegistrationService::RegisterSequence(
    grpc::CallbackServerContext* context) {
  return startBidi<v1::RegisterSequenceRequest, v1::RegisterResponse>(
      runtime_, runtime_.pool, "Registration.RegisterSequence", context, makeScanStream(models_, limits_));
}

grpc::ServerBidiReactor<v1::EstimateUnderClothingRequest, v1::EstimateUnderClothingResponse>*
RegistrationService::EstimateUnderClothing(grpc::CallbackServerContext* context) {
  return startBidi<v1::EstimateUnderClothingRequest, v1::EstimateUnderClothingResponse>(
      runtime_, runtime_.heavy, "Registration.EstimateUnderClothing", context,
      makeClothedStream(models_, limits_, runtime_.threads));
}

}  // namespace shaped::server
