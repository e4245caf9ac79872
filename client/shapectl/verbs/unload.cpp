#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Unload {
  std::string name;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model: NAME for all versions, NAME@VERSION for one");
  }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::UnloadModelRequest request;
    *request.mutable_model() = parseModel(name);
    v1::UnloadModelResponse response;
    client::require(stub->Unload(call.context(), request, &response));
    auto unloaded = nlohmann::json::array();
    for (const auto& model : response.unloaded()) {
      unloaded.push_back({{"name", model.name()}, {"version", model.version()}});
      if (!session.json) std::cout << "unloaded " << modelText(model) << "\n";
    }
    if (session.json) printJson({{"unloaded", unloaded}});
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb unloadVerb() { return makeVerb<Unload>("unload", "Drop a model from memory; the next request loads it again"); }

}  // namespace shaped::shapectl
