#pragma once

#include <vector>

#include "core/skeleton/pose.h"
#include "core/skeleton/rig.h"

namespace shaped {

/// A pose as one vector: the translation, then each joint's axis-angle vector; 3 + 3 J numbers.
Eigen::VectorXd toVector(const Pose& pose);
Pose poseFrom(const Eigen::VectorXd& vector);

/// A surface in a pose by linear blend skinning, x_i = sum_j w_ij (G_j (v_i - r_j) + p_j). Const; queries may run from
/// several threads at once. Refers to the skeleton and the weights, which must outlive it. How its points follow pose
/// and shape: PointDerivatives.
class PosedSkin {
 public:
  /// rest: V x 3, rest_joints: J x 3, both in the rest pose, m. Throws InvalidInput on counts that do not fit.
  PosedSkin(const Skeleton& skeleton, const SkinWeights& weights, Vertices rest, Vertices rest_joints,
            const Pose& pose);

  const Vertices& vertices() const { return posed_; }       ///< V x 3, m
  const PosedSkeleton& skeleton() const { return bones_; }  ///< where the bones stand

  /// T_i = sum_j w_ij G_j: how vertex i follows its own rest position while the joints stay.
  Eigen::Matrix3d blend(Eigen::Index vertex) const;

  /// G_j (v_i - r_j) + p_j: where bone j alone carries vertex i.
  Eigen::Vector3d carried(Eigen::Index vertex, Eigen::Index joint) const;
  /// By what the axis-angle vector of a joint is followed by the turn of all it carries: G_parent times the left
  /// Jacobian.
  const Eigen::Matrix3d& turn(std::int32_t joint) const { return turns_[std::size_t(joint)]; }

  const Skeleton& tree() const { return tree_; }
  const SkinWeights& weights() const { return weights_; }

 private:
  const Skeleton& tree_;
  const SkinWeights& weights_;
  Vertices rest_, rest_joints_, posed_;
  PosedSkeleton bones_;
  std::vector<Eigen::Matrix3d> turns_;
};

/// The posed surface alone, V x 3.
Vertices skinned(const Rig& rig, const Vertices& rest, const Pose& pose);

/// The surface back in the rest pose, V x 3: x_i -> T_i^-1 (x_i - sum_j w_ij (p_j - G_j r_j)), exact where `posed` came
/// from linear blend skinning with these rest joints. Throws InvalidInput naming the vertex where T_i is singular
/// (bones that share it stand opposite to each other).
Vertices unskinned(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& posed,
                   const Vertices& rest_joints, const Pose& pose);

}  // namespace shaped
