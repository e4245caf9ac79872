#include <iostream>

#include "client/jobs.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct DeleteJob {
  std::string id;

  void declare(Arguments& arguments) { arguments.positional("JOB", id, "The job's id, as `shapectl jobs` lists it"); }

  ExitCode run(const Session& session) const {
    client::deleteJob(*v1::Jobs::NewStub(session.channel()), id, session.callOptions());
    if (session.json)
      printJson({{"deleted", id}});
    else
      std::cout << "deleted job " << id << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb deleteJobVerb() { return makeVerb<DeleteJob>("delete-job", "Forget a job that has ended; its model stays"); }

}  // namespace shaped::shapectl
