#pragma once

#include <Eigen/Core>

#include "core/mesh/types.h"

namespace shaped {

/// x -> rotation x + translation, with a proper rotation (determinant +1).
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
};

/// x -> scale rotation x + translation.
struct SimilarityMotion {
  double scale = 1;  ///< >= 0
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
};

/// The rigid motion g that minimises sum_i w_i |g(source_i) - target_i|^2 (singular value decomposition of the
/// cross-covariance, [Ume91]).
///
/// source, target: n x 3, n >= 1, in correspondence. weights: n values >= 0 with a positive sum, or empty for equal
/// weights; points of weight zero are not read, so a missing one may be NaN. The rotation is proper even where a
/// reflection would fit better. Where the points leave it open (all on one line, or all in one place) it is the
/// smallest rotation among the minimisers. Throws InvalidInput naming `source`, `target` or `weights` on different
/// sizes, points that are not finite, or weights without a positive sum.
RigidMotion alignRigidly(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights = {});

/// The same with a uniform scale; 1 where the source points coincide, 0 where only the target points do.
SimilarityMotion alignSimilarly(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights = {});

/// The moved vertices, V x 3.
Vertices apply(const RigidMotion& motion, const Vertices& vertices);
Vertices apply(const SimilarityMotion& motion, const Vertices& vertices);

/// The motion that undoes this one.
RigidMotion inverse(const RigidMotion& motion);

}  // namespace shaped
