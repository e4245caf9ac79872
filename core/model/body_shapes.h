#pragma once

#include "core/model/body_model_file.h"
#include "core/model/shape_model.h"
#include "core/numerics/made_once.h"
#include "core/registration/field_deformation.h"

namespace shaped {

using BodyModelPtr = std::shared_ptr<const BodyModel>;

/// A body model as a served one. Its points are BodyCoefficients; it has no coarse mesh, so that `fine` changes
/// nothing. Scores are of the identity alone: every posture counts alike. The residual distance is the root mean square
/// distance of corresponding vertices.
class BodyShapes final : public ShapeModel {
 public:
  /// Throws InvalidInput as JacobianField does.
  BodyShapes(BodyModel model, BodyTrainingRecord training, std::optional<JacobianFieldWeights> field = std::nullopt);
  const BodyModelPtr& model() const { return model_; }
  const BodyTrainingRecord& training() const { return training_; }
  /// The mean at rest and its rig, as a template that registrations are normalised to.
  const PostureTemplate& reference() const { return reference_; }
  bool hasField() const { return field_.has_value(); }
  /// What registerScan deforms this model's fits with. Made when first asked for, which takes about a second for each
  /// 10,000 vertices; warm() and bytes() ask. Null without a field, or once the stop token has fired.
  std::shared_ptr<const FieldDeformation> field(const std::stop_token& stop = {}) const;

  std::string kind() const override { return kBodyKind; }
  const TopologyPtr& topologyPtr() const override { return model_->topology(); }
  const Vertices& mean() const override { return model_->parts().mean; }
  int modes() const override { return static_cast<int>(model_->modeCount()); }
  std::size_t bytes() const override;
  void warm() const override;
  /// The identity and pose nearest to a registered shape, from the pose that its vertices show (estimatePose), by
  /// fitBody with next to no prior.
  Solved<ShapeProjection> project(const Vertices& shape, const ProjectionOptions& options) const override;
  Solved<SynthesizedShape> synthesize(const ModelPoint& point, const SynthesisOptions& options) const override;
  std::unique_ptr<TakeFitter> takeFitter(const MarkerSet& markers, const TakeOptions& options) const override;
  std::int64_t publish(const ModelDirectory& directory, const std::string& name,
                       const nlohmann::json& provenance) const override;

 private:
  BodyModelPtr model_;
  BodyTrainingRecord training_;
  PostureTemplate reference_;  ///< the mean, at rest
  std::optional<JacobianFieldWeights> field_;
  MadeOnce<FieldDeformation> deformation_;
};

/// A state as one vector. modes: identities of fewer numbers are filled up with zeros.
BodyCoefficients coefficientsOf(const BodyState& state, Eigen::Index modes);
/// The state of coefficients. Throws InvalidInput naming "coefficients.body" when they are not as many as the model
/// takes, or not finite.
BodyState stateOf(const BodyModel& model, const BodyCoefficients& coefficients);

}  // namespace shaped
