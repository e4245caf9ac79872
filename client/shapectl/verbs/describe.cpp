#include <algorithm>
#include <iostream>

#include "client/shapectl/model_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::shapectl {
namespace {

/// As many as were kept, and how many there were.
void printVariances(const char* name, const google::protobuf::RepeatedField<double>& values, std::uint32_t kept) {
  std::cout << "  " << name;
  const int shown = std::min(values.size(), static_cast<int>(kept));
  for (int j = 0; j < shown; ++j) std::cout << " " << values[j];
  std::cout << " m^2";
  if (shown < values.size()) std::cout << ", and " << values.size() - shown << " smaller ones";
  std::cout << "\n";
}

void printText(const v1::ModelDescription::ShellPga& pga) {
  std::cout << "  modes        " << pga.modes() << "\n"
            << "  path steps   " << pga.path_steps() << "\n"
            << "  coarse mesh  " << pga.coarse_vertices() << " vertices\n"
            << "  bending      " << pga.bending() << " m^2\n"
            << "  path energy  " << pathEnergyText(pga.path_energy()) << "\n";
  printVariances("eigenvalues ", pga.eigenvalues(), pga.modes());
}

void printText(const v1::ModelDescription::Body& body) {
  std::cout << "  modes        " << body.modes() << "\n"
            << "  posture      " << nameOf(body.posture()) << "\n"
            << "  joints       " << body.joints_size() << (body.limits() ? ", with limits:" : ", without limits:");
  for (const auto& joint : body.joints()) std::cout << " " << joint.name();
  std::cout << "\n  field        " << (body.field() ? "yes, registrations are deformed by it" : "no") << "\n";
  if (body.joined_size() > 0) std::cout << "  grown by    ";
  for (const auto joined : body.joined()) std::cout << " " << joined;
  if (body.joined_size() > 0) std::cout << " scans, round by round\n";
  printVariances("variances   ", body.variances(), body.modes());
}

void printText(const v1::ModelDescription& model) {
  std::cout << modelText(model.model()) << "  (" << model.kind() << ", " << timeText(model.created()) << ")\n"
            << "  mesh         " << model.vertex_count() << " vertices, " << model.face_count() << " faces, topology "
            << model.topology_id() << "\n"
            << "  training     " << sizeOf(model).training_shapes << " shapes of dataset " << model.dataset() << "; "
            << reportText(model.training()) << "\n";
  if (model.has_shell_pga()) printText(model.shell_pga());
  if (model.has_body()) printText(model.body());
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
