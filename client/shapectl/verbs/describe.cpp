#include <algorithm>

#include <iostream>

#include "client/shapectl/model_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

void printText(const v1::ModelDescription& model) {
  const auto& pga = model.shell_pga();
  std::cout << modelText(model.model()) << "  (" << model.kind() << ", " << timeText(model.created()) << ")\n"
            << "  mesh         " << model.vertex_count() << " vertices, " << model.face_count() << " faces, topology "
            << model.topology_id() << "\n"
            << "  training     " << pga.training_shapes() << " shapes of dataset " << model.dataset() << "; "
            << reportText(model.training()) << "\n"
            << "  modes        " << pga.modes() << "\n"
            << "  path steps   " << pga.path_steps() << "\n"
            << "  coarse mesh  " << pga.coarse_vertices() << " vertices\n"
            << "  bending      " << pga.bending() << " m^2\n"
            << "  path energy  " << pathEnergyText(pga.path_energy()) << "\n"
            << "  eigenvalues ";
  const int shown = std::min(pga.eigenvalues_size(), static_cast<int>(pga.modes()));
  for (int j = 0; j < shown; ++j) std::cout << " " << pga.eigenvalues(j);
  std::cout << " m^2";
  if (shown < pga.eigenvalues_size()) std::cout << ", and " << pga.eigenvalues_size() - shown << " smaller ones";
  std::cout << "\n";
}

struct Describe {
  std::string name;

  void declare(Arguments& arguments) { arguments.positional("NAME", name, "The model, NAME or NAME@VERSION"); }

  ExitCode run(const Session& session) const {
    const auto stub = v1::Models::NewStub(session.channel());
    client::Call call(session.callOptions());
    v1::GetModelRequest request;
    *request.mutable_model() = parseModel(name);
    v1::GetModelResponse response;
    client::require(stub->Get(call.context(), request, &response));
    if (session.json)
      printJson(toJson(response.description()));
    else
      printText(response.description());
    return ExitCode::kSuccess;
  }
};

}  // namespace

Verb describeVerb() { return makeVerb<Describe>("describe", "Describe a model"); }

}  // namespace shaped::shapectl
