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

std::vector<v1::Job> listJobs(v1::Jobs::Stub& jobs, const std::vector<v1::JobState>& states,
                              const CallOptions& options) {
  v1::ListJobsRequest request;
  request.set_page_size(1000);
  for (const auto state : states) request.add_states(state);
  std::vector<v1::Job> all;
  do {
    Call call(options);
    v1::ListJobsResponse response;
    require(jobs.List(call.context(), request, &response));
    all.insert(all.end(), response.jobs().begin(), response.jobs().end());
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

void deleteJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options) {
  Call call(options);
  v1::DeleteJobRequest request;
  request.set_id(id);
  v1::DeleteJobResponse response;
  require(jobs.Delete(call.context(), request, &response));
}

}  // namespace shaped::client
