#pragma once

#include "server/rpc/call.h"
#include "shaped/v1/admin.grpc.pb.h"

namespace shaped::server {

class AdminService final : public v1::Admin::CallbackService {
 public:
  explicit AdminService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* GetStatistics(grpc::CallbackServerContext* context, const v1::GetStatisticsRequest* request,
                                          v1::GetStatisticsResponse* response) override;

 private:
  Runtime& runtime_;
};

}  // namespace shaped::server
