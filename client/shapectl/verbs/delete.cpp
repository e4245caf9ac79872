#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Delete {
  std::string name;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model: NAME for all versions, NAME@VERSION for one");
  }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::DeleteModelRequest request;
    *request.mutable_model() = parseModel(name);
    v1::DeleteModelResponse response;
    client::require(stub->Delete(call.context(), request, &response));
    auto deleted = nlohmann::json::array();
    for (const auto& model : response.deleted()) {
      deleted.push_back({{"name", model.name()}, {"version", model.version()}});
      if (!session.json) std::cout << "deleted " << modelText(model) << "\n";
    }
    if (session.json) printJson({{"deleted", deleted}});
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb deleteVerb() { return makeVerb<Delete>("delete", "Delete a model"); }

}  // namespace shaped::shapectl
