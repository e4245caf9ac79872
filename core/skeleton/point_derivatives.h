#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/skeleton/skinning.h"

namespace shaped {

/// How a shape at rest may change, by coefficients: k modes of the vertices and what the rest joints do then.
struct ShapeModes {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix vertices;  ///< 3 V x k, vertex by vertex
  Matrix joints;    ///< 3 J x k, joint by joint
};

/// How a point of a posed surface, sum_c share_c x_c over some vertices, follows pose and shape. It is turned to one
/// point after the other, as least squares problems go through many.
///
/// Turning joint j by a turns all it carries about p_j: d x = a cross sum_i w_i (x_i - p_j), i over j and its
/// descendants, w_i the point's weight of bone i and x_i where that bone alone carries it; a follows the joint's vector
/// through G_parent and the left Jacobian of SO(3). With the shape, a vertex moves by T_c d v_c + sum_i w_ci d t_i,
/// where T_c is its blend and t_i = p_i - G_i r_i the translation of bone i.
class PointDerivatives {
 public:
  /// In the pose alone. The skin must outlive it.
  explicit PointDerivatives(const PosedSkin& skin);
  /// In the shape, too; the modes must outlive it.
  PointDerivatives(const PosedSkin& skin, const ShapeModes& modes);

  /// Turns to a point; as many shares as vertices.
  void turnTo(std::span<const std::int32_t> vertices, std::span<const double> shares);

  /// The joints that move the point, from the root on. The derivatives in the turns of all others are zero.
  const std::vector<std::int32_t>& joints() const { return joints_; }
  /// d (direction . point) / d (translation, rotations), 3 + 3 J numbers: the rotations of joints() are written, the
  /// others left alone.
  void poseRow(const Eigen::Vector3d& direction, Eigen::Ref<Eigen::RowVectorXd> row) const;
  /// d (direction . point) / d coefficients, k numbers. Only with modes.
  void shapeRow(const Eigen::Vector3d& direction, Eigen::Ref<Eigen::RowVectorXd> row) const;

 private:
  struct Corner {
    std::int32_t vertex;
    Eigen::Matrix3d blend;  ///< share_c T_c
  };

  void findJoints();

  const PosedSkin& skin_;
  const ShapeModes* modes_ = nullptr;
  ShapeModes::Matrix bones_;  ///< d t_i, 3 J x k
  std::vector<Corner> corners_;
  std::vector<std::pair<std::int32_t, double>> weights_;  ///< of the bones that hold the point
  Eigen::Matrix4Xd held_;                                 ///< of each joint: sum_i w_i (x_i, 1)
  std::vector<std::int32_t> joints_;
};

}  // namespace shaped
