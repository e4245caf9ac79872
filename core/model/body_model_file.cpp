#include "core/model/body_model_file.h"

#include <cmath>

#include "core/io/file_error.h"
#include "core/io/json_fields.h"
#include "core/model/sparse_tensors.h"
#include "core/neural/jacobian_field_file.h"

namespace shaped {
namespace {

/// Of models without a field, and of those with one: a daemon that knows of none must not serve those as if they had
/// none.
constexpr int kPlainVersion = 1, kFieldVersion = 2;
constexpr const char* kField = "field";
constexpr int kMostCount = 1'000'000'000;  ///< of anything that a description counts
constexpr std::size_t kMostJoints = 1000;  ///< a fit's work and memory grow with their square
constexpr std::pair<PostureNormalisation, const char*> kPostures[] = {{PostureNormalisation::kNone, "none"},
                                                                      {PostureNormalisation::kSkeleton, "skeleton"},
                                                                      {PostureNormalisation::kLocal, "local"}};

nlohmann::json toJson(const Skeleton& skeleton) {
  auto joints = nlohmann::json::array();
  for (const auto& joint : skeleton.joints()) joints.push_back({{"name", joint.name}, {"parent", joint.parent}});
  return joints;
}

Skeleton skeletonFrom(const nlohmann::json& json) {
  if (!json.is_array() || json.size() > kMostJoints)
    throw InvalidInput("joints", "want a list of at most " + std::to_string(kMostJoints));
  std::vector<Joint> joints;
  for (const auto& joint : json)
    joints.push_back({joint.at("name").get<std::string>(),
                      static_cast<std::int32_t>(requireWholeNumber(joint, "parent", -1, kMostCount))});
  return Skeleton(std::move(joints));
}

void addVector(TensorWriter& tensors, const std::string& name, const Eigen::VectorXd& numbers) {
  tensors.add(name, {numbers.size()},
              std::span<const double>(numbers.data(), static_cast<std::size_t>(numbers.size())));
}

Eigen::VectorXd vectorFrom(const TensorFile& tensors, const std::string& name) {
  const auto numbers = tensors.values<double>(name);
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

void requireFalling(const char* name, const Eigen::VectorXd& numbers) {
  for (Eigen::Index i = 0; i < numbers.size(); ++i)
    if (!std::isfinite(numbers[i]) || (i > 0 && numbers[i] > numbers[i - 1]))
      throw InvalidInput(std::string(name) + "[" + std::to_string(i) + "]",
                         "is " + std::to_string(numbers[i]) + ", want finite numbers that fall");
}

void requireOrthonormal(const Eigen::MatrixXd& modes) {
  const Eigen::MatrixXd products = modes.transpose() * modes;
  const auto identity = Eigen::MatrixXd::Identity(modes.cols(), modes.cols());
  if (!((products - identity).cwiseAbs().maxCoeff() < 1e-6)) throw InvalidInput("modes", "are not orthonormal");
}

TopologyPtr topologyFrom(const TensorFile& tensors, Eigen::Index vertex_count) {
  return std::make_shared<Topology>(static_cast<std::int32_t>(vertex_count),
                                    Faces(tensors.matrix<std::int32_t>("faces", -1, 3)));
}

std::optional<JointLimits> limitsFrom(const nlohmann::json& description, const TensorFile& tensors,
                                      Eigen::Index joints) {
  if (!description.at("limits").get<bool>()) return std::nullopt;
  return JointLimits{tensors.matrix<double>("limits.low", joints, 3), tensors.matrix<double>("limits.high", joints, 3)};
}

BodyModel modelFrom(const nlohmann::json& description, const TensorFile& tensors) {
  const Vertices mean = tensors.matrix<double>("mean", -1, 3);
  auto skeleton = skeletonFrom(description.at("joints"));
  const Eigen::Index vertices = mean.rows(), joints = skeleton.jointCount();
  auto topology = topologyFrom(tensors, vertices);
  requireValidShape(*topology, mean, "mean");
  BodyParts parts{std::move(topology),
                  mean,
                  tensors.matrix<double>("modes", 3 * vertices, -1),
                  vectorFrom(tensors, "deviations"),
                  std::move(skeleton),
                  sparseFrom(tensors, "weights", vertices, joints),
                  sparseFrom(tensors, "regressor", joints, vertices),
                  limitsFrom(description, tensors, joints)};
  BodyModel model(std::move(parts));  // says what does not fit
  requireFalling("deviations", model.parts().deviations);
  requireOrthonormal(model.parts().modes);
  return model;
}

BodyTrainingRecord recordFrom(const nlohmann::json& description, const TensorFile& tensors) {
  BodyTrainingRecord record;
  record.registrations = static_cast<int>(requireWholeNumber(description, "training_shapes", 0, kMostCount));
  record.posture = postureNamed(description.at("posture").get<std::string>(), "posture");
  record.reach = description.at("reach").get<double>();
  record.seconds = description.at("training").at("seconds").get<double>();
  record.variances = vectorFrom(tensors, "variances");
  requireFalling("variances", record.variances);
  if (description.contains("joined")) record.joined = description.at("joined").get<std::vector<int>>();
  return record;
}

void requireRegression(const ResidualRegressionWeights& weights, const BodyModel& model) {
  const ResidualRegression complete(weights);  // says what does not fit
  const Eigen::Index state = model.modeCount() + 3 * (model.skeleton().jointCount() - 1);
  if (weights.offset_weights.rows() != model.topology()->vertexCount() || weights.state_weights.rows() != state)
    throw InvalidInput("field.regression",
                       "is for " + std::to_string(weights.offset_weights.rows()) + " vertices and " +
                           std::to_string(weights.state_weights.rows()) + " state coefficients, want " +
                           std::to_string(model.topology()->vertexCount()) + " and " + std::to_string(state));
}

std::optional<JacobianFieldWeights> fieldFrom(const ModelManifest& manifest, const TensorFile& tensors,
                                              const BodyModel& model) {
  if (!holdsField(manifest)) return std::nullopt;
  auto weights = readJacobianField(tensors, kField);
  const JacobianField complete(weights);  // says what does not fit
  if (weights.regression) requireRegression(*weights.regression, model);
  return weights;
}

}  // namespace

std::string name(PostureNormalisation posture) {
  for (const auto& [kind, text] : kPostures)
    if (kind == posture) return text;
  return "unknown";
}

PostureNormalisation postureNamed(const std::string& text, const std::string& field) {
  for (const auto& [kind, known] : kPostures)
    if (text == known) return kind;
  throw InvalidInput(field, "is \"" + text + "\", want none, skeleton or local");
}

std::int64_t publishBody(const ModelDirectory& directory, const std::string& name, const BodyModel& model,
                         const BodyTrainingRecord& training, const nlohmann::json& provenance,
                         const JacobianFieldWeights* field) {
  const auto& parts = model.parts();
  TensorWriter tensors;
  tensors.addMatrix("faces", parts.topology->faces());
  tensors.addMatrix("mean", parts.mean);
  tensors.addMatrix("modes", parts.modes);
  addVector(tensors, "deviations", parts.deviations);
  addVector(tensors, "variances", training.variances);
  addSparse(tensors, "weights", parts.weights);
  addSparse(tensors, "regressor", parts.regressor);
  if (parts.limits) {
    tensors.addMatrix("limits.low", parts.limits->low);
    tensors.addMatrix("limits.high", parts.limits->high);
  }
  if (field) addJacobianField(kField, *field, tensors);
  ModelManifest manifest;
  manifest.kind = kBodyKind;
  manifest.format_version = field ? kFieldVersion : kPlainVersion;
  manifest.created_by = "shaped " SHAPED_VERSION;
  manifest.description = {{"vertices", parts.topology->vertexCount()},
                          {"faces", parts.topology->faces().rows()},
                          {"topology", parts.topology->id()},
                          {"modes", model.modeCount()},
                          {"joints", toJson(parts.skeleton)},
                          {"limits", parts.limits.has_value()},
                          {"training_shapes", training.registrations},
                          {"posture", shaped::name(training.posture)},
                          {"reach", training.reach},
                          {"joined", training.joined},
                          {"training", {{"seconds", training.seconds}}},
                          {"provenance", provenance}};
  return directory.publish(name, std::move(manifest), tensors);
}

void requireBody(const ModelManifest& manifest) {
  if (manifest.kind != kBodyKind)
    throw InvalidInput("manifest", "is of kind \"" + manifest.kind + "\", want \"" + kBodyKind + "\"");
  if (manifest.format_version != kPlainVersion && manifest.format_version != kFieldVersion)
    throw InvalidInput("manifest", "has format version " + std::to_string(manifest.format_version) + ", want " +
                                       std::to_string(kPlainVersion) + " or " + std::to_string(kFieldVersion) +
                                       "; train it again or use the daemon that wrote it");
}

bool holdsField(const ModelManifest& manifest) {
  return manifest.kind == kBodyKind && manifest.format_version == kFieldVersion;
}

StoredBody bodyFrom(const ModelManifest& manifest, const TensorFile& tensors) try {
  requireBody(manifest);
  auto model = modelFrom(manifest.description, tensors);
  auto field = fieldFrom(manifest, tensors, model);
  return {std::move(model), recordFrom(manifest.description, tensors), std::move(field)};
} catch (const nlohmann::json::exception& problem) {
  throw InvalidInput("manifest", std::string("has a faulty description: ") + problem.what());
}

StoredBody loadBody(const StoredModel& stored) try {
  return bodyFrom(stored.manifest, *stored.tensors);
} catch (const InvalidInput& problem) {
  throw FileError("model " + stored.name + " version " + std::to_string(stored.version),
                  std::string("cannot be used: ") + problem.what());
}

}  // namespace shaped
