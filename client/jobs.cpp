#include "client/jobs.h"

namespace shaped::client {

v1::Job watchJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::Job&)>& update) {
  Call call(options);
  v1::WatchJobRequest request;
  request.set_id(id);
  const auto stream = jobs.Watch(call.context(), request);
  v1::WatchJobResponse response;
  while (stream->Read(&response)) update(response.job());
  require(stream->Finish());
  return response.job();
}

v1::Job cancelJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options) {
  Call call(options);
  v1::CancelJobRequest request;
  request.set_id(id);
  v1::CancelJobResponse response;
  require(jobs.Cancel(call.context(), request, &response));
  return response.job();
}

}  // namespace shaped::client
