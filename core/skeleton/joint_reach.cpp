#include "core/skeleton/joint_reach.h"

#include <algorithm>

#include "core/skeleton/foremost_joint.h"

namespace shaped {

std::vector<double> jointReach(const Skeleton& skeleton, const SkinWeights& weights, const Vertices& rest,
                               const Vertices& joints) {
  std::vector<double> reach(static_cast<std::size_t>(skeleton.jointCount()), 0.0);
  for (Eigen::Index v = 0; v < rest.rows(); ++v)
    for (auto joint = foremostJoint(weights, v); joint >= 0; joint = skeleton.parent(joint)) {
      double& farthest = reach[static_cast<std::size_t>(joint)];
      farthest = std::max(farthest, (rest.row(v) - joints.row(joint)).norm());
    }
  return reach;
}

}  // namespace shaped
