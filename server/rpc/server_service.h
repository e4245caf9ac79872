#pragma once

#include "server/convert/limits.h"
#include "server/rpc/call.h"
#include "shaped/v1/server.grpc.pb.h"

namespace shaped::server {

class ServerService final : public v1::Server::CallbackService {
 public:
  /// version: "shaped 0.1.0".
  ServerService(Runtime& runtime, const Limits& limits, std::string version)
      : runtime_(runtime), limits_(limits), version_(std::move(version)) {}

  grpc::ServerUnaryReactor* GetLimits(grpc::CallbackServerContext* context, const v1::GetLimitsRequest* request,
                                      v1::GetLimitsResponse* response) override;

 private:
  Runtime& runtime_;
  const Limits& limits_;
  const std::string version_;
};

}  // namespace shaped::server
