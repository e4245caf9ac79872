#pragma once

#include <stop_token>

#include "server/jobs/job_registry.h"
#include "server/jobs/job_runner.h"
#include "server/rpc/call.h"
#include "server/rpc/job_context.h"
#include "shaped/v1/jobs.grpc.pb.h"

namespace shaped::server {

class JobsService final : public v1::Jobs::CallbackService {
 public:
  JobsService(Runtime& runtime, const JobContext& context, JobRegistry& registry, JobRunner& runner)
      : runtime_(runtime), registry_(registry), runner_(runner), desk_{context, registry, runner} {}

  grpc::ServerUnaryReactor* Train(grpc::CallbackServerContext* context, const v1::TrainRequest* request,
                                  v1::TrainResponse* response) override;
  grpc::ServerUnaryReactor* Evaluate(grpc::CallbackServerContext* context, const v1::EvaluateJobRequest* request,
                                     v1::EvaluateJobResponse* response) override;
  grpc::ServerUnaryReactor* Project(grpc::CallbackServerContext* context, const v1::ProjectJobRequest* request,
                                    v1::ProjectJobResponse* response) override;
  grpc::ServerReadReactor<v1::FitMarkersJobRequest>* FitMarkers(grpc::CallbackServerContext* context,
                                                                v1::FitMarkersJobResponse* response) override;
  grpc::ServerWriteReactor<v1::GetJobResultResponse>* GetResult(grpc::CallbackServerContext* context,
                                                                const v1::GetJobResultRequest* request) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context, const v1::GetJobRequest* request,
                                v1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context, const v1::ListJobsRequest* request,
                                 v1::ListJobsResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* Watch(grpc::CallbackServerContext* context,
                                                        const v1::WatchJobRequest* request) override;
  grpc::ServerUnaryReactor* Cancel(grpc::CallbackServerContext* context, const v1::CancelJobRequest* request,
                                   v1::CancelJobResponse* response) override;
  grpc::ServerUnaryReactor* Wait(grpc::CallbackServerContext* context, const v1::WaitJobRequest* request,
                                 v1::WaitJobResponse* response) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context, const v1::DeleteJobRequest* request,
                                   v1::DeleteJobResponse* response) override;

  /// Ends all watching and waiting calls, as the daemon does when it stops.
  void stopWatching() { stop_.request_stop(); }

 private:
  Runtime& runtime_;
  JobRegistry& registry_;
  JobRunner& runner_;
  const JobDesk desk_;
  std::stop_source stop_;
};

}  // namespace shaped::server
