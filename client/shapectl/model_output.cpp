#include "client/shapectl/model_output.h"

#include "client/shapectl/output.h"

namespace shaped::shapectl {

std::string pathEnergyText(v1::PathEnergy energy) {
  return energy == v1::PATH_ENERGY_DIRECTED ? "directed" : "symmetric";
}

std::string nameOf(v1::ModelState state) {
  switch (state) {
    case v1::MODEL_STATE_STORED:
      return "stored";
    case v1::MODEL_STATE_LOADING:
      return "loading";
    case v1::MODEL_STATE_READY:
      return "ready";
    case v1::MODEL_STATE_FAILED:
      return "failed";
    default:
      return "unknown";
  }
}

std::string stateText(const v1::ModelDescription& description) {
  auto text = nameOf(description.state());
  if (description.memory_bytes() > 0) text += " " + std::to_string((description.memory_bytes() >> 20) + 1) + " MiB";
  if (description.serving()) text += " serving";
  for (const auto& label : description.labels()) text += " " + label;
  return text;
}

std::string nameOf(v1::PostureNormalisation posture) {
  switch (posture) {
    case v1::POSTURE_NORMALISATION_NONE:
      return "none";
    case v1::POSTURE_NORMALISATION_SKELETON:
      return "skeleton";
    case v1::POSTURE_NORMALISATION_LOCAL:
      return "local";
    default:
      return "unknown";
  }
}

ModelSize sizeOf(const v1::ModelDescription& description) {
  if (description.has_body()) return {description.body().training_shapes(), description.body().modes()};
  return {description.shell_pga().training_shapes(), description.shell_pga().modes()};
}

namespace {

nlohmann::json toJson(const v1::ModelDescription::ShellPga& pga) {
  return {{"training_shapes", pga.training_shapes()},
          {"modes", pga.modes()},
          {"path_steps", pga.path_steps()},
          {"coarse_vertices", pga.coarse_vertices()},
          {"bending", pga.bending()},
          {"path_energy", pathEnergyText(pga.path_energy())},
          {"eigenvalues", pga.eigenvalues()}};
}

nlohmann::json toJson(const v1::ModelDescription::Body& body) {
  auto joints = nlohmann::json::array();
  for (const auto& joint : body.joints()) joints.push_back({{"name", joint.name()}, {"parent", joint.parent()}});
  return {{"training_shapes", body.training_shapes()},
          {"modes", body.modes()},
          {"joints", joints},
          {"limits", body.limits()},
          {"posture", nameOf(body.posture())},
          {"field", body.field()},
          {"joined", body.joined()},
          {"variances", body.variances()}};
}

}  // namespace

nlohmann::json toJson(const v1::ModelDescription& description) {
  nlohmann::json document{{"kind", description.kind()},
                          {"topology_id", description.topology_id()},
                          {"vertices", description.vertex_count()},
                          {"faces", description.face_count()},
                          {"created", timeText(description.created())},
                          {"dataset", description.dataset()}};
  document["state"] = nameOf(description.state());
  document["memory_bytes"] = description.memory_bytes();
  document["labels"] = description.labels();
  document["serving"] = description.serving();
  addModel(document, description.model());
  addReport(document["training"], description.training());
  if (description.has_shell_pga()) document["shell_pga"] = toJson(description.shell_pga());
  if (description.has_body()) document["body"] = toJson(description.body());
  return document;
}

}  // namespace shaped::shapectl
