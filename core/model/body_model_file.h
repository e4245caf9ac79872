#pragma once

#include "core/body/body_training.h"
#include "core/io/model_directory.h"
#include "core/neural/jacobian_field.h"

namespace shaped {

/// The kind of a body model's manifest.
inline constexpr const char* kBodyKind = "body";

/// How a body model was trained.
struct BodyTrainingRecord {
  int registrations = 0;  ///< n
  PostureNormalisation posture = PostureNormalisation::kSkeleton;
  double reach = 0.1;            ///< of PostureNormalisation::kLocal [m]
  Eigen::VectorXd variances;     ///< of all modes of the training set, falling; those that were kept come first [m^2]
  double seconds = 0;            ///< set by whoever measured; 0 where nobody did
  std::vector<int> joined = {};  ///< of `registrations`, the scans that joined in each round of a bootstrap
};

/// What a body's file holds.
struct StoredBody {
  BodyModel model;
  BodyTrainingRecord training;
  std::optional<JacobianFieldWeights> field;  ///< that deforms its fits, where it was trained with one
};

/// "none", "skeleton", "local".
std::string name(PostureNormalisation posture);
/// Throws InvalidInput naming `field` for another text.
PostureNormalisation postureNamed(const std::string& text, const std::string& field);

/// Publishes a model as a new version and returns its number. provenance: as publishShellPga. field: its own, or null.
/// Throws as ModelDirectory::publish.
std::int64_t publishBody(const ModelDirectory& directory, const std::string& name, const BodyModel& model,
                         const BodyTrainingRecord& training,
                         const nlohmann::json& provenance = nlohmann::json::object(),
                         const JacobianFieldWeights* field = nullptr);

/// Throws InvalidInput naming "manifest" when the kind or format version is none that bodyFrom() reads.
void requireBody(const ModelManifest& manifest);

/// Whether a model's files hold a field, from its manifest alone.
bool holdsField(const ModelManifest& manifest);

/// Builds the model out of its files. Throws InvalidInput when kind or format version is another, the description or a
/// tensor is missing or of another type or shape, or BodyModel refuses what they hold; also when the mean is no valid
/// shape, the modes are not orthonormal, deviations and variances do not fall, or JacobianField refuses the field.
StoredBody bodyFrom(const ModelManifest& manifest, const TensorFile& tensors);

/// Builds the model that a stored version holds. Throws FileError naming the version where bodyFrom() throws.
StoredBody loadBody(const StoredModel& stored);

}  // namespace shaped
