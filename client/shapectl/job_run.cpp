#include "client/shapectl/job_run.h"

#include <iostream>

#include "client/shapectl/job_output.h"
#include "client/shapectl/output.h"

namespace shaped::shapectl {
namespace {

client::RpcError daemonGone(const v1::Job& job, const client::RpcError& error) {
  return client::RpcError({error.code(), std::string(error.what()) + "; job " + job.id() +
                                             " is kept: `shapectl watch " + job.id() + "` follows it again"});
}

}  // namespace

void JobFlags::declare(Arguments& arguments) {
  arguments.flag("--job", job, "As a job: it outlives the daemon; followed until it ends");
  arguments.flag("--detach", detach, "As a job that is left to itself: `shapectl watch JOB`, `shapectl result JOB`");
}

v1::Job follow(v1::Jobs::Stub& jobs, const v1::Job& job, const Session& session, ProgressBar& bar,
               const std::function<void(const v1::WatchJobResponse&)>& news) {
  const auto draw = [&](const v1::WatchJobResponse& state) {
    if (news) news(state);
    show(bar, state.job());
  };
  try {
    return client::watchJob(jobs, job.id(), session.callOptions(), draw);
  } catch (const client::RpcError& error) {
    if (!session.stop.stop_requested() && error.code() != grpc::DEADLINE_EXCEEDED) throw daemonGone(job, error);
    const client::CallOptions farewell{.timeout = std::chrono::seconds(10), .stop = {}};
    client::cancelJob(jobs, job.id(), farewell);
    const auto ended = client::watchJob(jobs, job.id(), farewell, draw);
    if (!session.stop.stop_requested()) throw;
    return ended;
  }
}

ExitCode runBatch(const Session& session, const JobFlags& flags, JobResultOutput& output,
                  const std::function<v1::Job(v1::Jobs::Stub&, ProgressBar&)>& start) {
  const auto jobs = v1::Jobs::NewStub(session.channel());
  v1::Job job;
  {
    ProgressBar bar;
    job = start(*jobs, bar);
    if (!flags.detach) job = follow(*jobs, job, session, bar);
  }
  if (flags.detach) return printStarted(job, session);
  if (job.state() != v1::JOB_STATE_SUCCEEDED) return printEnded(job, session);
  return printResult(*jobs, job.id(), session, output);
}

ExitCode printResult(v1::Jobs::Stub& jobs, const std::string& id, const Session& session, JobResultOutput& output) {
  client::fetchResult(jobs, id, session.callOptions(), [&](const auto& answer) { output.add(answer); });
  return output.finish(session);
}

}  // namespace shaped::shapectl
