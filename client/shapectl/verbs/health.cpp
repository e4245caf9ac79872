#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace shaped::shapectl {
namespace {

namespace health = grpc::health::v1;

// Of a probe without --timeout [s]: a daemon that does not say how it is in this time is not well.
constexpr double kPatience = 5;

/// For probes of containers and load balancers: the exit code alone says it all.
struct Health {
  void declare(Arguments&) {}

  ExitCode run(const Session& session) const {
    const auto stub = health::Health::NewStub(session.channel());
    auto options = session.callOptions();
    if (!options.timeout) options.timeout = std::chrono::duration<double>(kPatience);
    client::Call call(options);
    health::HealthCheckResponse response;
    client::require(stub->Check(call.context(), health::HealthCheckRequest(), &response));
    const bool serving = response.status() == health::HealthCheckResponse::SERVING;
    if (session.json)
      printJson({{"serving", serving}});
    else
      std::cout << (serving ? "serving" : "not serving: it is about to stop") << "\n";
    return serving ? ExitCode::kSuccess : ExitCode::kUnavailable;
  }
};

}  // namespace

Verb healthVerb() { return makeVerb<Health>("health", "Say whether the daemon takes calls: exit code 0, or 4"); }

}  // namespace shaped::shapectl
