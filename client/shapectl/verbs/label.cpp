#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/error.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Label {
  std::string name, label;
  bool remove = false;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model: NAME@VERSION, or NAME with --remove");
    arguments.positional("LABEL", label, "stable: what NAME alone means; canary, or any other name: NAME@LABEL");
    arguments.flag("--remove", remove, "Let the label stand for nothing any more");
  }

  ExitCode run(const Session& session) const {
    const auto model = parseModel(name);
    if (remove == (model.version() != 0) || !model.label().empty())
      throw InvalidInput(name, remove ? "want NAME with --remove" : "want NAME@VERSION");
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::SetLabelRequest request;
    request.set_name(model.name());
    request.set_label(label);
    request.set_version(model.version());
    v1::SetLabelResponse response;
    client::require(stub->SetLabel(call.context(), request, &response));
    if (session.json)
      printJson({{"name", model.name()}, {"label", label}, {"version", model.version()}});
    else
      std::cout << model.name() << "@" << label
                << (remove ? " is gone" : " is version " + std::to_string(model.version())) << "\n";
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb labelVerb() { return makeVerb<Label>("label", "Let a label stand for a version of a model"); }

}  // namespace shaped::shapectl
