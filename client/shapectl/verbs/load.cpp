#include <iostream>

#include "client/shapectl/model_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Load {
  std::string name;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model: NAME for the newest version on the disk, NAME@VERSION for another");
  }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::LoadModelRequest request;
    *request.mutable_model() = parseModel(name);
    v1::LoadModelResponse response;
    client::require(stub->Load(call.context(), request, &response));
    if (session.json)
      printJson(toJson(response.description()));
    else
      std::cout << "loaded " << modelText(response.description().model()) << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb loadVerb() { return makeVerb<Load>("load", "Read a model from the disk into memory, in place of the one before"); }

}  // namespace shaped::shapectl
