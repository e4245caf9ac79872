#include "server/rpc/shapes_service.h"

#include "server/rpc/interpolate.h"
#include "server/rpc/server_stream_call.h"

namespace shaped::server {

grpc::ServerWriteReactor<v1::InterpolateResponse>* ShapesService::Interpolate(grpc::CallbackServerContext* context,
                                                                              const v1::InterpolateRequest* request) {
  return startServerStream<v1::InterpolateRequest, v1::InterpolateResponse>(
      runtime_, runtime_.pool, "Shapes.Interpolate", context, request, interpolate);
}

}  // namespace shaped::server
