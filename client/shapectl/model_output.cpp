#include "client/shapectl/model_output.h"

#include "client/shapectl/output.h"

namespace shaped::shapectl {

std::string pathEnergyText(v1::PathEnergy energy) {
  return energy == v1::PATH_ENERGY_DIRECTED ? "directed" : "symmetric";
}

nlohmann::json toJson(const v1::ModelDescription& description) {
  nlohmann::json document{{"kind", description.kind()},
                          {"topology_id", description.topology_id()},
                          {"vertices", description.vertex_count()},
                          {"faces", description.face_count()},
                          {"created", timeText(description.created())},
                          {"dataset", description.dataset()}};
  addModel(document, description.model());
  addReport(document["training"], description.training());
  const auto& pga = description.shell_pga();
  document["shell_pga"] = {{"training_shapes", pga.training_shapes()},
                           {"modes", pga.modes()},
                           {"path_steps", pga.path_steps()},
                           {"coarse_vertices", pga.coarse_vertices()},
                           {"bending", pga.bending()},
                           {"path_energy", pathEnergyText(pga.path_energy())},
                           {"eigenvalues", pga.eigenvalues()}};
  return document;
}

}  // namespace shaped::shapectl
