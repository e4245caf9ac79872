#include "server/rpc/admin_service.h"

#include "server/convert/statistics.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {

grpc::ServerUnaryReactor* AdminService::GetStatistics(grpc::CallbackServerContext* context,
                                                      const v1::GetStatisticsRequest* request,
                                                      v1::GetStatisticsResponse* response) {
  return startUnary<v1::GetStatisticsRequest, v1::GetStatisticsResponse>(
      runtime_, runtime_.light, "Admin.GetStatistics", context, request, response,
      [this](const auto&, auto& answer, Call&) { toProto(runtime_.metrics.snapshot(), answer); });
}

}  // namespace shaped::server
