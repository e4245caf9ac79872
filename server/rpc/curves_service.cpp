#include "server/rpc/curves_service.h"

#include "server/jobs/arena.h"
#include "server/rpc/motion_curves.h"
#include "server/rpc/server_stream_call.h"

namespace shaped::server {

using Context = grpc::CallbackServerContext;

grpc::ServerWriteReactor<v1::SmoothResponse>* CurvesService::Smooth(Context* context,
                                                                    const v1::SmoothRequest* request) {
  return startServerStream<v1::SmoothRequest, v1::SmoothResponse>(
      runtime_, runtime_.heavy, "Curves.Smooth", context, request,
      [this](const auto& wanted, const auto& write, Call& call) {
        runInBackground(runtime_.threads, [&] { smooth(sources_.datasets, sources_.limits, wanted, write, call); });
      });
}

grpc::ServerWriteReactor<v1::GeodesicResponse>* CurvesService::Geodesic(Context* context,
                                                                        const v1::GeodesicRequest* request) {
  return startServerStream<v1::GeodesicRequest, v1::GeodesicResponse>(
      runtime_, runtime_.pool, "Curves.Geodesic", context, request,
      [this](const auto& wanted, const auto& write, Call& call) { geodesic(sources_, wanted, write, call); });
}

grpc::ServerWriteReactor<v1::BezierResponse>* CurvesService::Bezier(Context* context,
                                                                    const v1::BezierRequest* request) {
  return startServerStream<v1::BezierRequest, v1::BezierResponse>(
      runtime_, runtime_.heavy, "Curves.Bezier", context, request,
      [this](const auto& wanted, const auto& write, Call& call) {
        runInBackground(runtime_.threads, [&] { bezier(sources_, wanted, write, call); });
      });
}

grpc::ServerWriteReactor<v1::JoinResponse>* CurvesService::Join(Context* context, const v1::JoinRequest* request) {
  return startServerStream<v1::JoinRequest, v1::JoinResponse>(
      runtime_, runtime_.heavy, "Curves.Join", context, request,
      [this](const auto& wanted, const auto& write, Call& call) {
        runInBackground(runtime_.threads, [&] { join(sources_.datasets, sources_.limits, wanted, write, call); });
      });
}

}  // namespace shaped::server
