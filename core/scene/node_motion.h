#pragma once

#include <map>
#include <vector>

#include "core/scene/scene_import.h"

namespace shaped {

/// Where the nodes of a scene stand while an animation runs, or without one.
class NodeMotion {
 public:
  /// animation: null for the scene as it stands. Both must outlive the motion.
  NodeMotion(const aiScene& scene, const aiAnimation* animation);

  double duration() const { return duration_; }  ///< s

  /// The world transform of the node at that time: of a node's parents and itself, nothing beside. Linear between keys,
  /// turns by slerp, the first and last key beyond them.
  Eigen::Affine3d world(const aiNode& node, double seconds) const;

 private:
  Eigen::Affine3d local(const aiNode& node, double seconds) const;

  std::map<const aiNode*, const aiNodeAnim*> channels_;
  double ticks_per_second_ = 1, duration_ = 0;
};

}  // namespace shaped
