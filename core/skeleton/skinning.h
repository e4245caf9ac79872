#pragma once

#include <vector>

#include "core/skeleton/pose.h"
#include "core/skeleton/rig.h"

namespace shaped {

/// A pose as one vector: the translation, then each joint's axis-angle vector; 3 + 3 J numbers.
Eigen::VectorXd toVector(const Pose& pose);
Pose poseFrom(const Eigen::VectorXd& vector);

/// A surface in a pose by linear blend skinning, x_i = sum_j w_ij (G_j (v_i - r_j) + p_j), with its derivatives in the
/// pose and in the shape. Const; queries may run from several threads at once. Refers to the skeleton and the weights,
/// which must outlive it.
class PosedSkin {
 public:
  /// rest: V x 3, rest_joints: J x 3, both in the rest pose, m. Throws InvalidInput on counts that do not fit.
  PosedSkin(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& rest, const Vertices& rest_joints,
            const Pose& pose);

  const Vertices& vertices() const { return posed_; }       ///< V x 3, m
  const PosedSkeleton& skeleton() const { return bones_; }  ///< where the bones stand

  /// T_i = sum_j w_ij G_j: how vertex i follows its own rest position while the joints stay.
  Eigen::Matrix3d blend(Eigen::Index vertex) const;

  /// d x_i / d (translation, rotations): 3 x (3 + 3 J), into `columns`, which is overwritten. Turning joint j by a
  /// turns all it carries about p_j: d x_i = a cross sum_k w_ik (x_ik - p_j), k over j and its descendants, and a
  /// follows the joint's vector through G_parent and the left Jacobian of SO(3).
  void poseDerivative(Eigen::Index vertex, Eigen::Ref<Eigen::Matrix3Xd> columns) const;

  /// The same for any point of the surface and direction: d (direction . sum_c share_c x_c) / d (translation,
  /// rotations). Adds a vertex with its share to `levers` (3 x J, zero to begin with); from the sum, poseRow makes the
  /// row, 3 + 3 J numbers.
  void addLevers(Eigen::Index vertex, double share, Eigen::Matrix3Xd& levers) const;
  void poseRow(const Eigen::Matrix3Xd& levers, const Eigen::Vector3d& direction,
               Eigen::Ref<Eigen::RowVectorXd> row) const;

  /// How the joints' part of d x_i / d shape goes: for rest joints that change by `joint_modes` (3 J x k, joint by
  /// joint), what each bone's translation p_j - G_j r_j changes by, J matrices of 3 x k.
  std::vector<Eigen::Matrix3Xd> boneDerivatives(const Eigen::MatrixXd& joint_modes) const;

  /// How a vertex at rest follows the shape: 3 x k, rows of modes that lie one after the other in memory.
  using VertexModes =
      Eigen::Ref<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>, 0, Eigen::OuterStride<>>;

  /// Adds share times d (direction . x_i) / d shape to `row`, k numbers: direction^T (T_i vertex_modes + sum_j w_ij
  /// bones_j). bones: from boneDerivatives.
  void addShapeRow(Eigen::Index vertex, double share, const Eigen::Vector3d& direction, const VertexModes& vertex_modes,
                   const std::vector<Eigen::Matrix3Xd>& bones, Eigen::Ref<Eigen::RowVectorXd> row) const;

 private:
  Eigen::Vector3d carried(Eigen::Index vertex, Eigen::Index joint) const;

  const Skeleton& tree_;
  const SkinWeights& weights_;
  Vertices rest_, rest_joints_, posed_;
  PosedSkeleton bones_;
  std::vector<Eigen::Matrix3d> turns_;  ///< G_parent times the left Jacobian, of each joint
};

/// The posed surface alone, V x 3.
Vertices skinned(const Rig& rig, const Vertices& rest, const Pose& pose);

/// The surface back in the rest pose, V x 3: x_i -> T_i^-1 (x_i - sum_j w_ij (p_j - G_j r_j)), exact where `posed` came
/// from linear blend skinning with these rest joints. Throws InvalidInput naming the vertex where T_i is singular
/// (bones that share it stand opposite to each other).
Vertices unskinned(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& posed,
                   const Vertices& rest_joints, const Pose& pose);

}  // namespace shaped
