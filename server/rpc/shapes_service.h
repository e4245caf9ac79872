#pragma once

#include "server/rpc/call.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::server {

class ShapesService final : public v1::Shapes::CallbackService {
 public:
  explicit ShapesService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerWriteReactor<v1::InterpolateResponse>* Interpolate(grpc::CallbackServerContext* context,
                                                                 const v1::InterpolateRequest* request) override;

 private:
  Runtime& runtime_;
};

}  // namespace shaped::server
