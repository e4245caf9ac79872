#include "server/rpc/jobs_service.h"

#include "server/convert/job.h"
#include "server/rpc/unary_call.h"
#include "server/rpc/watch_call.h"

namespace shaped::server {

grpc::ServerUnaryReactor* JobsService::Train(grpc::CallbackServerContext* context, const v1::TrainRequest* request,
                                             v1::TrainResponse* response) {
  return startUnary<v1::TrainRequest, v1::TrainResponse>(
      runtime_, runtime_.light, "Jobs.Train", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) { toProto(start_training_(wanted), *answer.mutable_job()); });
}

grpc::ServerUnaryReactor* JobsService::Get(grpc::CallbackServerContext* context, const v1::GetJobRequest* request,
                                           v1::GetJobResponse* response) {
  return startUnary<v1::GetJobRequest, v1::GetJobResponse>(
      runtime_, runtime_.light, "Jobs.Get", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) { toProto(registry_.get(wanted.id()), *answer.mutable_job()); });
}

grpc::ServerUnaryReactor* JobsService::List(grpc::CallbackServerContext* context, const v1::ListJobsRequest* request,
                                            v1::ListJobsResponse* response) {
  return startUnary<v1::ListJobsRequest, v1::ListJobsResponse>(runtime_, runtime_.light, "Jobs.List", context, request,
                                                               response, [this](const auto&, auto& answer, Call&) {
                                                                 for (const auto& record : registry_.list())
                                                                   toProto(record, *answer.add_jobs());
                                                               });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* JobsService::Watch(grpc::CallbackServerContext* context,
                                                                   const v1::WatchJobRequest* request) {
  const auto call = std::make_shared<WatchCall>(runtime_, registry_, *context, request->id());
  call->enter();
  return call.get();
}

grpc::ServerUnaryReactor* JobsService::Cancel(grpc::CallbackServerContext* context, const v1::CancelJobRequest* request,
                                              v1::CancelJobResponse* response) {
  return startUnary<v1::CancelJobRequest, v1::CancelJobResponse>(
      runtime_, runtime_.light, "Jobs.Cancel", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) { toProto(runner_.cancel(wanted.id()), *answer.mutable_job()); });
}

}  // namespace shaped::server
