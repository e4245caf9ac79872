#include <iostream>

#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

v1::JobState stateOf(const std::string& text) {
  for (int value = v1::JOB_STATE_QUEUED; value <= v1::JOB_STATE_CANCELLED; ++value)
    if (nameOf(static_cast<v1::JobState>(value)) == text) return static_cast<v1::JobState>(value);
  throw InvalidInput("--state", "\"" + text + "\", want queued, running, succeeded, failed or cancelled");
}

struct Jobs {
  std::vector<std::string> states;

  void declare(Arguments& arguments) {
    arguments.option("--state", states, "STATE", "Only queued, running, succeeded, failed or cancelled ones; several");
  }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Jobs::NewStub(session.channel());
    std::vector<v1::JobState> wanted;
    for (const auto& state : states) wanted.push_back(stateOf(state));
    auto jobs = nlohmann::json::array();
    for (const auto& job : client::listJobs(*stub, wanted, session.callOptions())) {
      jobs.push_back(toJson(job));
      if (!session.json) std::cout << jobText(job) << "\n";
    }
    if (session.json) printJson({{"jobs", jobs}});
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb jobsVerb() { return makeVerb<Jobs>("jobs", "List jobs, oldest first"); }

}  // namespace shaped::shapectl
