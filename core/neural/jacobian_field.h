#pragma once

#include <optional>
#include <vector>

#include "core/neural/dense_layers.h"
#include "core/neural/jacobian_field_features.h"
#include "core/neural/residual_regression.h"
#include "core/neural/smooth_residual.h"

namespace shaped {

/// A trained field, as plain numbers.
struct JacobianFieldWeights {
  FieldScaling scaling;
  std::vector<Linear> source_net;  ///< PointNet of the source's triangles: 56 inputs, s outputs
  std::vector<Linear> scan_net;    ///< PointNet of the scan's points: 6 inputs, p outputs
  /// 65 + s + p + (15) + s + p inputs, 9 outputs. A triangle's inputs in order: its own 56; its current Jacobian (9);
  /// its feature by source_net; the feature by scan_net of the scan's point nearest to its centroid; its offsets (15)
  /// if `offsets`; the features of the whole source and of the whole scan.
  std::vector<Linear> mlp;
  /// Our addition: how far the scan is off, its normals and its Jacobians (JacobianFieldFeatures::offsets). The paper's
  /// features hold the first two only as differences of numbers that agree to a hundredth, and the last not at all, as
  /// no triangle sees its neighbours.
  bool offsets = false;
  /// Our addition: what a fit goes through before the field sees it, for whoever applies a field to fits. The field
  /// itself leaves it alone; it is of one topology.
  std::optional<ResidualRegressionWeights> regression = std::nullopt;
  /// Likewise, after the regression; of any topology of the same kind of body.
  std::optional<SmoothPrior> smoothness = std::nullopt;

  /// Inputs that a triangle has of its own; those of the whole shape and scan come after.
  Eigen::Index localInputs() const;
};

/// Whether the field leaves every shape as it is: its last layer is all zeros.
bool isSilent(const JacobianFieldWeights& weights);

/// Neural Jacobian field [Aigerman et al. 2022; Muralikrishnan 2025, section 3.3.3 and appendix B.4.1]: says from what
/// a shape and a scan of another look like at each triangle how that triangle is to be deformed, and the Poisson
/// equation makes a shape of it. It knows nothing of the mesh, so one field serves every topology.
///
/// The perceptron's output is what is added to the source's current Jacobian, so that zeros (as in a field whose last
/// layer has not been trained) leave the source as it is. Immutable; usable from several threads at once.
class JacobianField {
 public:
  /// Throws InvalidInput naming `scaling`, `prior` (of smoothness), or the network and its layer, when their sizes do
  /// not fit together or a number is not finite.
  explicit JacobianField(JacobianFieldWeights weights);

  /// The Jacobians that each triangle is to have, relative to the reference of the features, F x 9. Throws InvalidInput
  /// naming `features` when its parts do not fit together.
  Jacobians predict(const JacobianFieldFeatures& features) const;

  /// The shape of these Jacobians, V x 3 [m], components centred where the source's are: a field of Jacobians says
  /// nothing of places, so what the source is off by on the whole stays. poisson: of the features' reference.
  Vertices deform(const JacobianPoisson& poisson, const JacobianFieldFeatures& features) const;

  const JacobianFieldWeights& weights() const { return weights_; }

 private:
  JacobianFieldWeights weights_;
  PointNet source_net_, scan_net_;
};

}  // namespace shaped
