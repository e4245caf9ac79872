#include "server/convert/job.h"

#include "core/numerics/error.h"
#include "server/convert/report.h"
#include "server/convert/time.h"

namespace shaped::server {
namespace {

v1::JobState toProto(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return v1::JOB_STATE_QUEUED;
    case JobState::kRunning:
      return v1::JOB_STATE_RUNNING;
    case JobState::kSucceeded:
      return v1::JOB_STATE_SUCCEEDED;
    case JobState::kFailed:
      return v1::JOB_STATE_FAILED;
    case JobState::kCancelled:
      return v1::JOB_STATE_CANCELLED;
  }
  return v1::JOB_STATE_UNSPECIFIED;
}

}  // namespace

JobState stateFromProto(v1::JobState state, const std::string& field) {
  for (const auto one :
       {JobState::kQueued, JobState::kRunning, JobState::kSucceeded, JobState::kFailed, JobState::kCancelled})
    if (toProto(one) == state) return one;
  throw InvalidInput(field, std::to_string(state) + " is no state of a job");
}

void toProto(const JobRecord& record, v1::Job& job) {
  job.set_id(record.id);
  job.set_state(toProto(record.state));
  job.set_model_name(record.model_name);
  job.set_dataset(record.dataset);
  job.set_stage(record.stage);
  job.set_fraction(record.fraction);
  job.set_residual(record.residual);
  toProto(record.created, *job.mutable_created());
  if (record.started) toProto(*record.started, *job.mutable_started());
  if (record.ended) toProto(*record.ended, *job.mutable_ended());
  job.set_error(record.error);
  job.set_error_code(record.error_code);
  job.set_kind(record.kind);
  job.set_attempts(record.attempts);
  job.set_resumed_from(record.resumed_from);
  job.set_request_id(record.request_id);
  job.set_cancel_requested(record.cancel_requested);
  if (!record.result) return;
  toProto(record.result->outcome, record.result->seconds, *job.mutable_report());
  job.set_smallest_area_ratio(record.result->smallest_area_ratio);
  if (record.result->model_version == 0) return;
  job.mutable_model()->set_name(record.result->model_name);
  job.mutable_model()->set_version(record.result->model_version);
}

}  // namespace shaped::server
