#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Watch {
  std::string id;

  void declare(Arguments& arguments) { arguments.positional("JOB", id, "The job's id, as `shapectl jobs` lists it"); }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Jobs::NewStub(session.channel());
    v1::Job last;
    {
      ProgressBar bar;
      last = client::watchJob(*stub, id, session.callOptions(),
                              [&](const v1::WatchJobResponse& state) { show(bar, state.job()); });
    }
    return printEnded(last, session);
  }
};

}  // namespace

Verb watchVerb() { return makeVerb<Watch>("watch", "Follow a job until it ends; Ctrl-C leaves it running"); }

}  // namespace shaped::shapectl
