#pragma once

#include <optional>

#include "core/mesh/topology.h"
#include "core/skeleton/joint_regressor.h"
#include "core/skeleton/point_derivatives.h"

namespace shaped {

/// Who and how: a point of a body model.
struct BodyState {
  Eigen::VectorXd identity;  ///< w_id, one number a mode, in standard deviations
  Pose pose;                 ///< w_pose
};

/// What a body model is made of.
struct BodyParts {
  TopologyPtr topology;
  Vertices mean;               ///< V x 3, in the rest pose, m
  Eigen::MatrixXd modes;       ///< 3 V x k, orthonormal columns
  Eigen::VectorXd deviations;  ///< k standard deviations, positive and falling, m
  Skeleton skeleton;
  SkinWeights weights;       ///< V x J
  JointRegressor regressor;  ///< J x V
  std::optional<JointLimits> limits;
};

/// A simplified SCAPE body (S-SCAPE) [Wuh18, chapter 9]: a linear space of identities in the rest pose (9.1), posed by
/// linear blend skinning (9.2), about joints that follow the identity. A model without a rig (faces, hands at rest) has
/// a single joint that carries everything: its pose is a rigid motion.
///
/// Identities have a Gaussian prior, the standard normal distribution of their coefficients; the joints have box
/// limits. Immutable.
class BodyModel {
 public:
  /// Throws InvalidInput naming the part when sizes do not fit, numbers are not finite, a deviation is not positive, or
  /// weights or regressor rows do not sum to 1.
  explicit BodyModel(BodyParts parts);

  const TopologyPtr& topology() const { return parts_.topology; }
  const Skeleton& skeleton() const { return parts_.skeleton; }
  const BodyParts& parts() const { return parts_; }
  Eigen::Index modeCount() const { return parts_.deviations.size(); }

  /// The mean identity at rest.
  BodyState meanState() const;

  /// The identity in the rest pose, c = A w_id + mean (9.1), V x 3. identity: k numbers, else InvalidInput.
  Vertices rest(const Eigen::VectorXd& identity) const;
  /// The joints of that identity at rest, J x 3.
  Vertices restJoints(const Eigen::VectorXd& identity) const;

  /// The identity in a pose (9.3), with its derivatives. Throws InvalidInput naming what does not fit. The model must
  /// outlive it.
  PosedSkin posed(const BodyState& state) const;

  /// How vertices and joints at rest follow the identity: the rows of A times the deviations.
  const ShapeModes& shapeModes() const { return shape_modes_; }

  /// Coefficients of a shape that stands in the model's rest pose and place, by orthogonal projection.
  Eigen::VectorXd identityOf(const Vertices& rest) const;

  /// The first `modes` modes alone, 1 .. modeCount().
  BodyModel truncated(Eigen::Index modes) const;

 private:
  BodyParts parts_;
  ShapeModes shape_modes_;
  Vertices mean_joints_;
};

}  // namespace shaped
