#include "server/rpc/models_service.h"

#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {

grpc::ServerUnaryReactor* ModelsService::List(grpc::CallbackServerContext* context,
                                              const v1::ListModelsRequest* request, v1::ListModelsResponse* response) {
  return startUnary<v1::ListModelsRequest, v1::ListModelsResponse>(
      runtime_, runtime_.light, "Models.List", context, request, response, [this](const auto&, auto& answer, Call&) {
        for (const auto& entry : store_.list()) toProto(entry, *answer.add_models());
      });
}

grpc::ServerUnaryReactor* ModelsService::Get(grpc::CallbackServerContext* context, const v1::GetModelRequest* request,
                                             v1::GetModelResponse* response) {
  return startUnary<v1::GetModelRequest, v1::GetModelResponse>(
      runtime_, runtime_.light, "Models.Get", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) {
        const auto model = store_.pin(wanted.model().name(), wanted.model().version());
        call.setModel(model->name, model->version);
        toProto(*model, *answer.mutable_description());
        if (wanted.with_mean()) toProto(model->shell_pga->mean(), model->shell_pga->topology(), *answer.mutable_mean());
      });
}

grpc::ServerUnaryReactor* ModelsService::Delete(grpc::CallbackServerContext* context,
                                                const v1::DeleteModelRequest* request,
                                                v1::DeleteModelResponse* response) {
  return startUnary<v1::DeleteModelRequest, v1::DeleteModelResponse>(
      runtime_, runtime_.light, "Models.Delete", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) {
        for (const auto version : store_.remove(wanted.model().name(), wanted.model().version())) {
          auto& deleted = *answer.add_deleted();
          deleted.set_name(wanted.model().name());
          deleted.set_version(version);
        }
      });
}

}  // namespace shaped::server
