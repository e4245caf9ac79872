#include <iostream>

#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Cancel {
  std::string id;

  void declare(Arguments& arguments) { arguments.positional("JOB", id, "The job's id, as `shapectl jobs` lists it"); }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Jobs::NewStub(session.channel());
    const auto job = client::cancelJob(*stub, id, session.callOptions());
    if (session.json)
      printJson(toJson(job));
    else
      std::cout << jobText(job) << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb cancelVerb() { return makeVerb<Cancel>("cancel", "Ask a job to stop"); }

}  // namespace shaped::shapectl
