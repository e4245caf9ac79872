#include "server/convert/model.h"

#include <limits>

#include "core/io/json_fields.h"
#include "core/model/body_shapes.h"
#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_shapes.h"
#include "core/numerics/error.h"
#include "server/convert/report.h"
#include "server/convert/time.h"

namespace shaped::server {
namespace {

constexpr std::pair<v1::PostureNormalisation, PostureNormalisation> kPostures[] = {
    {v1::POSTURE_NORMALISATION_SKELETON, PostureNormalisation::kSkeleton},
    {v1::POSTURE_NORMALISATION_UNSPECIFIED, PostureNormalisation::kSkeleton},
    {v1::POSTURE_NORMALISATION_NONE, PostureNormalisation::kNone},
    {v1::POSTURE_NORMALISATION_LOCAL, PostureNormalisation::kLocal}};

v1::PathEnergy pathEnergyOf(bool symmetric) { return symmetric ? v1::PATH_ENERGY_SYMMETRIC : v1::PATH_ENERGY_DIRECTED; }

v1::ModelState stateOf(ModelState state) {
  switch (state) {
    case ModelState::kStored:
      return v1::MODEL_STATE_STORED;
    case ModelState::kLoading:
      return v1::MODEL_STATE_LOADING;
    case ModelState::kReady:
      return v1::MODEL_STATE_READY;
    case ModelState::kFailed:
      return v1::MODEL_STATE_FAILED;
  }
  return v1::MODEL_STATE_UNSPECIFIED;
}

// Fields of a manifest's description, empty or 0 where they are missing or of another type: whoever loads the model
// says what is wrong with it, the list of all models must not fail.
std::string textIn(const nlohmann::json& description, const char* field) {
  const auto found = description.find(field);
  return found != description.end() && found->is_string() ? found->get<std::string>() : "";
}

double numberIn(const nlohmann::json& description, const char* field) {
  const auto found = description.find(field);
  return found != description.end() && found->is_number() ? found->get<double>() : 0;
}

std::uint32_t countIn(const nlohmann::json& description, const char* field) {
  constexpr std::int64_t most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(wholeNumber(description, field, 0, most).value_or(0));
}

void setIdentity(const std::string& name, std::uint64_t version, const ModelManifest& manifest,
                 v1::ModelDescription& description) {
  description.mutable_model()->set_name(name);
  description.mutable_model()->set_version(version);
  description.set_kind(manifest.kind);
  const auto provenance = provenanceOf(manifest);
  description.set_dataset(provenance.dataset);
  if (provenance.created.time_since_epoch().count() > 0) toProto(provenance.created, *description.mutable_created());
}

void describe(const nlohmann::json& json, v1::ModelDescription::ShellPga& pga) {
  pga.set_training_shapes(countIn(json, "training_shapes"));
  pga.set_modes(countIn(json, "modes"));
  pga.set_path_steps(countIn(json, "path_steps"));
  pga.set_coarse_vertices(countIn(json, "coarse_vertices"));
  pga.set_bending(numberIn(json, "bending"));
  pga.set_path_energy(pathEnergyOf(textIn(json, "path_energy") == "symmetric"));
}

void describe(const ModelManifest& manifest, v1::ModelDescription::Body& body) {
  body.set_training_shapes(countIn(manifest.description, "training_shapes"));
  body.set_modes(countIn(manifest.description, "modes"));
  body.set_field(holdsField(manifest));
}

void describe(const ShellPgaModel& model, v1::ModelDescription& description) {
  const auto& parts = model.parts();
  toProto(parts.training.combined(), parts.training.seconds, *description.mutable_training());
  auto& pga = *description.mutable_shell_pga();
  pga.set_training_shapes(static_cast<std::uint32_t>(parts.training.shapes));
  pga.set_modes(static_cast<std::uint32_t>(model.modes()));
  pga.set_path_steps(static_cast<std::uint32_t>(parts.pga.path_steps));
  pga.set_coarse_vertices(static_cast<std::uint32_t>(parts.coarsening.coarse->vertexCount()));
  pga.set_bending(parts.bending);
  pga.set_path_energy(pathEnergyOf(parts.symmetry == EnergySymmetry::kSymmetric));
  for (const double value : parts.pga.eigenvalues) pga.add_eigenvalues(value);
}

void describe(const BodyShapes& shapes, v1::ModelDescription& description) {
  const auto& parts = shapes.model()->parts();
  const auto& training = shapes.training();
  toProto(Outcome{Termination::kConverged, 0, 0}, training.seconds, *description.mutable_training());
  auto& body = *description.mutable_body();
  body.set_training_shapes(static_cast<std::uint32_t>(training.registrations));
  body.set_modes(static_cast<std::uint32_t>(shapes.modes()));
  for (const auto& joint : parts.skeleton.joints()) {
    auto& message = *body.add_joints();
    message.set_name(joint.name);
    message.set_parent(joint.parent);
  }
  body.set_limits(parts.limits.has_value());
  body.set_posture(server::toProto(training.posture));
  for (const double value : training.variances) body.add_variances(value);
  body.set_field(shapes.hasField());
  for (const int joined : training.joined) body.add_joined(static_cast<std::uint32_t>(joined));
}

SubmanifoldPoint submanifoldPoint(const v1::Coefficients& coefficients) {
  SubmanifoldPoint point;
  point.alpha = Eigen::Map<const Eigen::VectorXd>(coefficients.alpha().data(), coefficients.alpha_size());
  point.scale = coefficients.scale();
  return point;
}

void fill(const SubmanifoldPoint& point, v1::Coefficients& coefficients) {
  coefficients.mutable_alpha()->Add(point.alpha.begin(), point.alpha.end());
  coefficients.set_scale(point.scale);
}

void fill(const BodyCoefficients& body, v1::Coefficients& coefficients) {
  coefficients.mutable_body()->Add(body.numbers.begin(), body.numbers.end());
}

}  // namespace

ModelSelector selectorFromProto(const v1::ModelSelector& message) {
  return {message.name(), message.version(), message.label()};
}

void toProto(const ModelStore::Standing& standing, v1::ModelDescription& description) {
  description.mutable_labels()->Add(standing.labels.begin(), standing.labels.end());
  description.set_serving(standing.serving);
}

void toProto(const ModelStore::Entry& entry, v1::ModelDescription& description) {
  setIdentity(entry.name, entry.version, entry.manifest, description);
  const auto& json = entry.manifest.description;
  description.set_topology_id(textIn(json, "topology"));
  description.set_vertex_count(countIn(json, "vertices"));
  description.set_face_count(countIn(json, "faces"));
  if (entry.manifest.kind == kShellPgaKind) describe(json, *description.mutable_shell_pga());
  if (entry.manifest.kind == kBodyKind) describe(entry.manifest, *description.mutable_body());
  description.set_state(stateOf(entry.state));
  description.set_memory_bytes(entry.bytes);
  toProto(entry.standing, description);
}

void toProto(const ServedModel& model, v1::ModelDescription& description) {
  setIdentity(model.name, model.version, model.manifest, description);
  const auto& topology = model.shapes->topology();
  description.set_topology_id(topology.id());
  description.set_vertex_count(static_cast<std::uint32_t>(topology.vertexCount()));
  description.set_face_count(static_cast<std::uint32_t>(topology.faces().rows()));
  if (const auto* shell = dynamic_cast<const ShellPgaShapes*>(model.shapes.get()))
    describe(*shell->model(), description);
  if (const auto* body = dynamic_cast<const BodyShapes*>(model.shapes.get())) describe(*body, description);
  description.set_state(v1::MODEL_STATE_READY);
  description.set_memory_bytes(model.bytes);
}

ModelPoint coefficientsFromProto(const v1::Coefficients& coefficients, const Limits& limits) {
  requireAtMost(coefficients.alpha_size(), limits.coefficients, "coefficients.alpha", "weights");
  requireAtMost(coefficients.body_size(), limits.coefficients, "coefficients.body", "numbers");
  if (coefficients.body_size() == 0) return submanifoldPoint(coefficients);
  if (coefficients.alpha_size() > 0)
    throw InvalidInput("coefficients", "has both alpha and body, want those of the model's kind alone");
  return BodyCoefficients{Eigen::Map<const Eigen::VectorXd>(coefficients.body().data(), coefficients.body_size())};
}

void toProto(const ModelPoint& point, v1::Coefficients& coefficients) {
  std::visit([&](const auto& numbers) { fill(numbers, coefficients); }, point);
}

PostureNormalisation postureFromProto(v1::PostureNormalisation wanted, const std::string& field) {
  for (const auto& [wire, posture] : kPostures)
    if (wire == wanted) return posture;
  throw InvalidInput(field, std::to_string(wanted) + " is no PostureNormalisation");
}

v1::PostureNormalisation toProto(PostureNormalisation posture) {
  for (const auto& [wire, one] : kPostures)
    if (one == posture && wire != v1::POSTURE_NORMALISATION_UNSPECIFIED) return wire;
  return v1::POSTURE_NORMALISATION_UNSPECIFIED;
}

void toProto(const ShapeScore& score, v1::Score& message) {
  message.set_mahalanobis(score.mahalanobis);
  message.set_log_likelihood(score.log_likelihood);
  message.set_residual_distance(score.residual_distance);
}

int countFromProto(std::uint32_t value, int most, const std::string& field) {
  if (value > static_cast<std::uint32_t>(most))
    throw InvalidInput(field, "= " + std::to_string(value) + ", want at most " + std::to_string(most));
  return static_cast<int>(value);
}

}  // namespace shaped::server
