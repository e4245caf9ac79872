#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Wait {
  std::string name;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME, NAME@VERSION or NAME@LABEL; it need not be there yet");
  }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::WaitUntilReadyRequest request;
    *request.mutable_model() = parseModel(name);
    v1::WaitUntilReadyResponse response;
    client::require(stub->WaitUntilReady(call.context(), request, &response));
    if (session.json)
      printJson({{"name", response.model().name()}, {"version", response.model().version()}});
    else
      std::cout << modelText(response.model()) << " is ready\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb waitVerb() { return makeVerb<Wait>("wait", "Wait until a model is in the daemon's memory"); }

}  // namespace shaped::shapectl
