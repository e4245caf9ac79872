#include <iostream>

#include "client/shapectl/job_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/jobs.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Jobs {
  void declare(Arguments&) {}

  ExitCode run(const Session& session) const {
    const auto stub = v1::Jobs::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::ListJobsResponse response;
    client::require(stub->List(call.context(), {}, &response));
    auto jobs = nlohmann::json::array();
    for (const auto& job : response.jobs()) {
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
