#include "client/admin.h"

namespace shaped::client {

v1::GetStatisticsResponse getStatistics(v1::Admin::Stub& admin, const CallOptions& options) {
  Call call(options);
  v1::GetStatisticsResponse response;
  require(admin.GetStatistics(call.context(), {}, &response));
  return response;
}

}  // namespace shaped::client
