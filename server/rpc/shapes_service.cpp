#include "server/rpc/shapes_service.h"

#include "server/rpc/evaluate.h"
#include "server/rpc/interpolate.h"
#include "server/rpc/marker_stream.h"
#include "server/rpc/server_stream_call.h"
#include "server/rpc/shape_handlers.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {
namespace {

using Context = grpc::CallbackServerContext;

}  // namespace

grpc::ServerUnaryReactor* ShapesService::Project(Context* context, const v1::ProjectRequest* request,
                                                 v1::ProjectResponse* response) {
  return startUnary<v1::ProjectRequest, v1::ProjectResponse>(
      runtime_, runtime_.pool, "Shapes.Project", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) { project(models_, wanted, answer, call); });
}

grpc::ServerUnaryReactor* ShapesService::Synthesize(Context* context, const v1::SynthesizeRequest* request,
                                                    v1::SynthesizeResponse* response) {
  return startUnary<v1::SynthesizeRequest, v1::SynthesizeResponse>(
      runtime_, runtime_.pool, "Shapes.Synthesize", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) { synthesize(models_, limits_, wanted, answer, call); });
}

grpc::ServerWriteReactor<v1::InterpolateResponse>* ShapesService::Interpolate(Context* context,
                                                                              const v1::InterpolateRequest* request) {
  return startServerStream<v1::InterpolateRequest, v1::InterpolateResponse>(
      runtime_, runtime_.pool, "Shapes.Interpolate", context, request,
      [this](const auto& wanted, const auto& write, Call& call) { interpolate(limits_, wanted, write, call); });
}

grpc::ServerUnaryReactor* ShapesService::Edit(Context* context, const v1::EditRequest* request,
                                              v1::EditResponse* response) {
  return startUnary<v1::EditRequest, v1::EditResponse>(
      runtime_, runtime_.pool, "Shapes.Edit", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) { edit(models_, limits_, wanted, answer, call); });
}

grpc::ServerBidiReactor<v1::FitMarkersRequest, v1::FitMarkersResponse>* ShapesService::FitMarkers(Context* context) {
  return startBidi<v1::FitMarkersRequest, v1::FitMarkersResponse>(runtime_, runtime_.pool, "Shapes.FitMarkers", context,
                                                                  makeMarkerStream(models_, limits_));
}

grpc::ServerUnaryReactor* ShapesService::Score(Context* context, const v1::ScoreRequest* request,
                                               v1::ScoreResponse* response) {
  return startUnary<v1::ScoreRequest, v1::ScoreResponse>(
      runtime_, runtime_.pool, "Shapes.Score", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) { score(models_, wanted, answer, call); });
}

grpc::ServerUnaryReactor* ShapesService::Evaluate(Context* context, const v1::EvaluateRequest* request,
                                                  v1::EvaluateResponse* response) {
  return startUnary<v1::EvaluateRequest, v1::EvaluateResponse>(
      runtime_, runtime_.heavy, "Shapes.Evaluate", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) {
        evaluate(models_, datasets_, runtime_.threads, wanted, answer, call);
      });
}

}  // namespace shaped::server
