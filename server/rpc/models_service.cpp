#include "server/rpc/models_service.h"

#include "core/numerics/error.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/rpc/answer.h"
#include "server/rpc/model_transfer.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {
namespace {

void requireNoLabel(const v1::ModelSelector& model) {
  if (!model.label().empty()) throw InvalidInput("model.label", "has no meaning here; name a version, or 0");
}

void setVersion(const std::string& name, std::uint64_t version, v1::ModelVersion& message) {
  message.set_name(name);
  message.set_version(version);
}

}  // namespace

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
        const auto model = pinModel(store_, wanted, call);
        toProto(*model, *answer.mutable_description());
        toProto(store_.standing(model->name, model->version), *answer.mutable_description());
        if (wanted.with_mean()) toProto(model->shapes->mean(), model->shapes->topology(), *answer.mutable_mean());
      });
}

grpc::ServerUnaryReactor* ModelsService::Load(grpc::CallbackServerContext* context, const v1::LoadModelRequest* request,
                                              v1::LoadModelResponse* response) {
  return startUnary<v1::LoadModelRequest, v1::LoadModelResponse>(
      runtime_, runtime_.light, "Models.Load", context, request, response,
      [this, pending = PendingModelPtr()](const auto& wanted, auto& answer, Call& call) mutable {
        requireNoLabel(wanted.model());
        if (!pending) pending = store_.load(wanted.model().name(), wanted.model().version());
        const auto model = pending->get();
        call.setModel(model->name, model->version);
        toProto(*model, *answer.mutable_description());
        toProto(store_.standing(model->name, model->version), *answer.mutable_description());
      });
}

grpc::ServerUnaryReactor* ModelsService::Unload(grpc::CallbackServerContext* context,
                                                const v1::UnloadModelRequest* request,
                                                v1::UnloadModelResponse* response) {
  return startUnary<v1::UnloadModelRequest, v1::UnloadModelResponse>(
      runtime_, runtime_.light, "Models.Unload", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) {
        requireNoLabel(wanted.model());
        for (const auto version : store_.unload(wanted.model().name(), wanted.model().version()))
          setVersion(wanted.model().name(), version, *answer.add_unloaded());
      });
}

grpc::ServerUnaryReactor* ModelsService::WaitUntilReady(grpc::CallbackServerContext* context,
                                                        const v1::WaitUntilReadyRequest* request,
                                                        v1::WaitUntilReadyResponse* response) {
  return startUnary<v1::WaitUntilReadyRequest, v1::WaitUntilReadyResponse>(
      runtime_, runtime_.light, "Models.WaitUntilReady", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) {
        const auto model = store_.ready(selectorFromProto(wanted.model()));
        call.setModel(model->name, model->version);
        setVersion(model->name, model->version, *answer.mutable_model());
      });
}

grpc::ServerUnaryReactor* ModelsService::SetLabel(grpc::CallbackServerContext* context,
                                                  const v1::SetLabelRequest* request, v1::SetLabelResponse* response) {
  return startUnary<v1::SetLabelRequest, v1::SetLabelResponse>(
      runtime_, runtime_.light, "Models.SetLabel", context, request, response,
      [this](const auto& wanted, auto&, Call&) { store_.setLabel(wanted.name(), wanted.label(), wanted.version()); });
}

grpc::ServerUnaryReactor* ModelsService::Delete(grpc::CallbackServerContext* context,
                                                const v1::DeleteModelRequest* request,
                                                v1::DeleteModelResponse* response) {
  return startUnary<v1::DeleteModelRequest, v1::DeleteModelResponse>(
      runtime_, runtime_.light, "Models.Delete", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) {
        requireNoLabel(wanted.model());
        for (const auto version : store_.remove(wanted.model().name(), wanted.model().version()))
          setVersion(wanted.model().name(), version, *answer.add_deleted());
      });
}

grpc::ServerWriteReactor<v1::DownloadModelResponse>* ModelsService::Download(grpc::CallbackServerContext* context,
                                                                             const v1::DownloadModelRequest* request) {
  return startOutgoing<v1::DownloadModelRequest, v1::DownloadModelResponse>(
      runtime_, runtime_.light, "Models.Download", context, request, sendModel(store_, limits_));
}

grpc::ServerReadReactor<v1::UploadModelRequest>* ModelsService::Upload(grpc::CallbackServerContext* context,
                                                                       v1::UploadModelResponse* response) {
  return startClientStream<v1::UploadModelRequest, v1::UploadModelResponse>(
      runtime_, runtime_.light, "Models.Upload", context, response, receiveModel(store_, limits_));
}

}  // namespace shaped::server
