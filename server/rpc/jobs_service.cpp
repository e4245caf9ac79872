#include "server/rpc/jobs_service.h"

#include <algorithm>

#include "server/convert/job.h"
#include "server/errors/errors.h"
#include "server/jobs/record_file.h"
#include "server/rpc/caller.h"
#include "server/rpc/evaluate.h"
#include "server/rpc/marker_job.h"
#include "server/rpc/outgoing_stream_call.h"
#include "server/rpc/project_job.h"
#include "server/rpc/training.h"
#include "server/rpc/unary_call.h"
#include "server/rpc/wait_call.h"
#include "server/rpc/watch_call.h"

namespace shaped::server {
namespace {

constexpr std::uint32_t kDefaultPage = 100, kLargestPage = 1000;

void list(const JobRegistry& registry, const v1::ListJobsRequest& request, v1::ListJobsResponse& response) {
  JobQuery query{{}, request.page_token(), request.page_size() == 0 ? kDefaultPage : request.page_size()};
  query.limit = std::min<std::size_t>(query.limit, kLargestPage);
  for (int i = 0; i < request.states_size(); ++i)
    query.states.push_back(stateFromProto(request.states(i), "states[" + std::to_string(i) + "]"));
  ++query.limit;  // one more tells whether there is a next page
  auto records = registry.list(query);
  if (records.size() == query.limit) {
    records.pop_back();
    response.set_next_page_token(records.back().id);
  }
  for (const auto& record : records) toProto(record, *response.add_jobs());
}

/// Who may start jobs that only answer may cancel and delete these, too; what publishes is for those who train.
void requireMayEnd(const Access* access, const grpc::CallbackServerContext& context, const JobRunner& runner,
                   const JobRecord& job) {
  if (!runner.publishes(job.kind) || callerHolds(access, context, Role::kTrain)) return;
  throw NotAllowed("job " + job.id + " publishes a model: cancelling or deleting it needs the role \"train\"");
}

using ResultCall = OutgoingStreamCall<v1::GetJobResultRequest, v1::GetJobResultResponse>;

/// The answers of a job, from the first that is not skipped.
ResultCall::Next answersOf(const JobRunner& runner, const v1::GetJobResultRequest& request) {
  auto reader = std::make_shared<RecordReader>(runner.resultOf(request.id()));
  return [reader, id = request.id(), skip = request.skip(), record = std::string(), index = std::uint64_t{0}](
             v1::GetJobResultResponse& answer, Call&) mutable {
    do
      if (!reader->next(record)) return false;
    while (index++ < skip);
    if (!answer.ParseFromString(record))
      throw Corrupted("the result of job " + id + " cannot be read at answer " + std::to_string(index - 1));
    return true;
  };
}

}  // namespace

grpc::ServerUnaryReactor* JobsService::Train(grpc::CallbackServerContext* context, const v1::TrainRequest* request,
                                             v1::TrainResponse* response) {
  return startUnary<v1::TrainRequest, v1::TrainResponse>(runtime_, runtime_.light, "Jobs.Train", context, request,
                                                         response, [this](const auto& wanted, auto& answer, Call&) {
                                                           toProto(startTraining(desk_, wanted), *answer.mutable_job());
                                                         });
}

grpc::ServerUnaryReactor* JobsService::Evaluate(grpc::CallbackServerContext* context,
                                                const v1::EvaluateJobRequest* request,
                                                v1::EvaluateJobResponse* response) {
  return startUnary<v1::EvaluateJobRequest, v1::EvaluateJobResponse>(
      runtime_, runtime_.light, "Jobs.Evaluate", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) {
        toProto(startEvaluation(desk_, wanted, call), *answer.mutable_job());
      });
}

grpc::ServerUnaryReactor* JobsService::Project(grpc::CallbackServerContext* context,
                                               const v1::ProjectJobRequest* request, v1::ProjectJobResponse* response) {
  return startUnary<v1::ProjectJobRequest, v1::ProjectJobResponse>(
      runtime_, runtime_.light, "Jobs.Project", context, request, response,
      [this](const auto& wanted, auto& answer, Call& call) {
        toProto(startProjection(desk_, wanted, call), *answer.mutable_job());
      });
}

grpc::ServerReadReactor<v1::FitMarkersJobRequest>* JobsService::FitMarkers(grpc::CallbackServerContext* context,
                                                                           v1::FitMarkersJobResponse* response) {
  return startClientStream<v1::FitMarkersJobRequest, v1::FitMarkersJobResponse>(
      runtime_, runtime_.light, "Jobs.FitMarkers", context, response, makeTakeUpload(desk_));
}

grpc::ServerWriteReactor<v1::GetJobResultResponse>* JobsService::GetResult(grpc::CallbackServerContext* context,
                                                                           const v1::GetJobResultRequest* request) {
  return startOutgoing<v1::GetJobResultRequest, v1::GetJobResultResponse>(
      runtime_, runtime_.light, "Jobs.GetResult", context, request,
      [this](const auto& wanted, Call&) { return answersOf(runner_, wanted); });
}

grpc::ServerUnaryReactor* JobsService::Get(grpc::CallbackServerContext* context, const v1::GetJobRequest* request,
                                           v1::GetJobResponse* response) {
  return startUnary<v1::GetJobRequest, v1::GetJobResponse>(
      runtime_, runtime_.light, "Jobs.Get", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) { toProto(registry_.get(wanted.id()), *answer.mutable_job()); });
}

grpc::ServerUnaryReactor* JobsService::List(grpc::CallbackServerContext* context, const v1::ListJobsRequest* request,
                                            v1::ListJobsResponse* response) {
  return startUnary<v1::ListJobsRequest, v1::ListJobsResponse>(
      runtime_, runtime_.light, "Jobs.List", context, request, response,
      [this](const auto& wanted, auto& answer, Call&) { list(registry_, wanted, answer); });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* JobsService::Watch(grpc::CallbackServerContext* context,
                                                                   const v1::WatchJobRequest* request) {
  const auto call =
      std::make_shared<WatchCall>(runtime_, registry_, runner_, *context, request->id(), stop_.get_token());
  call->enter(*request);
  return call.get();
}

grpc::ServerUnaryReactor* JobsService::Cancel(grpc::CallbackServerContext* context, const v1::CancelJobRequest* request,
                                              v1::CancelJobResponse* response) {
  return startUnary<v1::CancelJobRequest, v1::CancelJobResponse>(
      runtime_, runtime_.light, "Jobs.Cancel", context, request, response,
      [this, context](const auto& wanted, auto& answer, Call&) {
        requireMayEnd(runtime_.access, *context, runner_, registry_.get(wanted.id()));
        toProto(runner_.cancel(wanted.id()), *answer.mutable_job());
      });
}

grpc::ServerUnaryReactor* JobsService::Wait(grpc::CallbackServerContext* context, const v1::WaitJobRequest* request,
                                            v1::WaitJobResponse* response) {
  const auto call = std::make_shared<WaitCall>(runtime_, registry_, *context, *request, *response, stop_.get_token());
  call->enter(*request);
  return call.get();
}

grpc::ServerUnaryReactor* JobsService::Delete(grpc::CallbackServerContext* context, const v1::DeleteJobRequest* request,
                                              v1::DeleteJobResponse* response) {
  return startUnary<v1::DeleteJobRequest, v1::DeleteJobResponse>(
      runtime_, runtime_.light, "Jobs.Delete", context, request, response,
      [this, context](const auto& wanted, auto&, Call&) {
        requireMayEnd(runtime_.access, *context, runner_, registry_.get(wanted.id()));
        runner_.forget(wanted.id());
      });
}

}  // namespace shaped::server
