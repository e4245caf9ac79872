#pragma once

#include "server/rpc/geodesic_curves.h"
#include "shaped/v1/curves.grpc.pb.h"

namespace shaped::server {

/// A geodesic is work for a solver; motions and Bezier curves take minutes and give way to others.
class CurvesService final : public v1::Curves::CallbackService {
 public:
  CurvesService(Runtime& runtime, const Limits& limits, ModelStore& models, DatasetStore& datasets)
      : runtime_(runtime), sources_{models, datasets, limits} {}

  grpc::ServerWriteReactor<v1::SmoothResponse>* Smooth(grpc::CallbackServerContext* context,
                                                       const v1::SmoothRequest* request) override;
  grpc::ServerWriteReactor<v1::GeodesicResponse>* Geodesic(grpc::CallbackServerContext* context,
                                                           const v1::GeodesicRequest* request) override;
  grpc::ServerWriteReactor<v1::BezierResponse>* Bezier(grpc::CallbackServerContext* context,
                                                       const v1::BezierRequest* request) override;
  grpc::ServerWriteReactor<v1::JoinResponse>* Join(grpc::CallbackServerContext* context,
                                                   const v1::JoinRequest* request) override;

 private:
  Runtime& runtime_;
  const TopologySources sources_;
};

}  // namespace shaped::server
