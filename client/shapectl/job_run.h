#pragma once

#include <functional>

#include "client/jobs.h"
#include "client/shapectl/arguments.h"
#include "client/shapectl/job_result.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// How a verb whose work may be a job is to do it.
struct JobFlags {
  bool job = false;     ///< as a job, which is followed until it ends
  bool detach = false;  ///< as a job, which is left to itself

  bool any() const { return job || detach; }
  /// --job and --detach.
  void declare(Arguments& arguments);
};

/// Follows a job until it ends. Nobody waits for it any more once that is broken off by Ctrl-C or --timeout: it is
/// cancelled. When the daemon goes away, the job stays: it goes on with the next start. news: hears what it tells.
v1::Job follow(v1::Jobs::Stub& jobs, const v1::Job& job, const Session& session, ProgressBar& bar,
               const std::function<void(const v1::WatchJobResponse&)>& news = {});

/// Starts a batch job; detached, prints it; else follows it and gives its result to the output.
ExitCode runBatch(const Session& session, const JobFlags& flags, JobResultOutput& output,
                  const std::function<v1::Job(v1::Jobs::Stub&, ProgressBar&)>& start);

/// Fetches the result of a job that has succeeded.
ExitCode printResult(v1::Jobs::Stub& jobs, const std::string& id, const Session& session, JobResultOutput& output);

}  // namespace shaped::shapectl
