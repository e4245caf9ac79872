#include "core/scene/bound_pose.h"

#include <algorithm>
#include <cmath>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Fails unless the transform keeps shapes up to their size.
void requireSimilarity(const std::string& file, const aiNode& node, const Eigen::Affine3d& transform) {
  const double scale = std::cbrt(transform.linear().determinant());
  const Eigen::Matrix3d turn = transform.linear() / scale;
  if (!(scale > 0) || !((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3))
    throw InvalidInput(file, "stands the mesh by a transform at joint " + quotedWord(node.mName.C_Str()) +
                                 " that mirrors, shears or scales axes differently; want turns, shifts and one scale");
}

}  // namespace

BoundPose boundPose(const std::string& file, const aiScene& scene, const SkinnedMesh& mesh,
                    const std::vector<SceneJoint>& joints, double metres_per_unit) {
  const NodeMotion still(scene, nullptr);
  const auto bone = [&](const SceneJoint& joint) {
    return mesh.bones[static_cast<std::size_t>(joint.bone)].inverse_bind;
  };
  const auto first = std::find_if(joints.begin(), joints.end(), [](const auto& joint) { return joint.bone >= 0; });
  const Eigen::Affine3d in_units = still.world(*first->node, 0) * bone(*first);
  BoundPose bound;
  bound.stand = Eigen::Scaling(metres_per_unit) * in_units;
  requireSimilarity(file, *first->node, bound.stand);
  bound.rest_joints.resize(static_cast<Eigen::Index>(joints.size()), 3);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    bound.inverse_bind.push_back(joints[j].bone >= 0 ? bone(joints[j])
                                                     : still.world(*joints[j].node, 0).inverse() * in_units);
    const Eigen::Vector3d place = bound.stand * bound.inverse_bind.back().inverse().translation();
    if (!place.allFinite())
      throw InvalidInput(file, "binds joint " + quotedWord(joints[j].node->mName.C_Str()) + " to no finite place");
    bound.rest_joints.row(static_cast<Eigen::Index>(j)) = place.transpose();
  }
  return bound;
}

}  // namespace shaped
