#include "tests/support/literal_skinning.h"

namespace shaped::test {

Vertices skinLiterally(const Rig& rig, const Vertices& vertices, const Pose& pose) {
  const auto posed = poseSkeleton(rig.skeleton, rig.rest_joints, pose);
  Vertices skinned = Vertices::Zero(vertices.rows(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v)
    for (SkinWeights::InnerIterator entry(rig.weights, v); entry; ++entry) {
      const Eigen::RowVector3d arm = vertices.row(v) - rig.rest_joints.row(entry.col());
      const auto& rotation = posed.rotations[static_cast<std::size_t>(entry.col())];
      skinned.row(v) += entry.value() * (arm * rotation.transpose() + posed.joints.row(entry.col()));
    }
  return skinned;
}

}  // namespace shaped::test
