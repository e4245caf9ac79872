#include "client/jobs.h"

#include "client/sending.h"

namespace shaped::client {

v1::Job getJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options) {
  Call call(options);
  v1::GetJobRequest request;
  request.set_id(id);
  v1::GetJobResponse response;
  require(jobs.Get(call.context(), request, &response));
  return response.job();
}

v1::Job watchJob(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::WatchJobResponse&)>& update) {
  Call call(options);
  v1::WatchJobRequest request;
  request.set_id(id);
  const auto stream = jobs.Watch(call.context(), request);
  v1::WatchJobResponse response;
  while (stream->Read(&response)) update(response);
  require(stream->Finish());
  return response.job();
}

v1::Job startTraining(v1::Jobs::Stub& jobs, const v1::TrainRequest& request, const CallOptions& options) {
  Call call(options);
  v1::TrainResponse response;
  require(jobs.Train(call.context(), request, &response));
  return response.job();
}

v1::Job startEvaluation(v1::Jobs::Stub& jobs, const v1::EvaluateJobRequest& request, const CallOptions& options) {
  Call call(options);
  v1::EvaluateJobResponse response;
  require(jobs.Evaluate(call.context(), request, &response));
  return response.job();
}

v1::Job startProjection(v1::Jobs::Stub& jobs, const v1::ProjectJobRequest& request, const CallOptions& options) {
  Call call(options);
  v1::ProjectJobResponse response;
  require(jobs.Project(call.context(), request, &response));
  return response.job();
}

v1::Job startMarkerFit(v1::Jobs::Stub& jobs, const v1::FitMarkersJobRequest::Header& header, const MarkerFrames& frames,
                       const CallOptions& options, const std::function<void(std::int64_t)>& progress) {
  Call call(options);
  v1::FitMarkersJobResponse response;
  const auto writer = jobs.FitMarkers(call.context(), &response);
  sendAll(call, *writer, [&](const auto& send) {
    v1::FitMarkersJobRequest message;
    *message.mutable_header() = header;
    bool open = send(message);
    std::int64_t sent = 0;
    for (const auto number : frames.numbers) {
      if (!open) break;
      *message.mutable_frame() = packFrame(frames, number);
      open = send(message);
      progress(++sent);
    }
  });
  return response.job();
}

void fetchResult(v1::Jobs::Stub& jobs, const std::string& id, const CallOptions& options,
                 const std::function<void(const v1::GetJobResultResponse&)>& answer) {
  v1::GetJobResultRequest request;
  request.set_id(id);
  while (true) {
    Call call(options);
    const auto before = request.skip();
    const auto stream = jobs.GetResult(call.context(), request);
    v1::GetJobResultResponse response;
    try {
      while (stream->Read(&response)) {
        answer(response);
        request.set_skip(request.skip() + 1);
      }
    } catch (...) {
      call.context()->TryCancel();
      stream->Finish();
      throw;
    }
    const auto status = stream->Finish();
    // The server's cap on a call's time, or a connection that broke; our own deadline is meant.
    const bool cut_off = status.error_code() == grpc::UNAVAILABLE ||
                         (status.error_code() == grpc::DEADLINE_EXCEEDED && !options.timeout);
    if (!cut_off || request.skip() == before) return require(status);
  }
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
