#pragma once

#include <string>

#include "core/scene/bound_pose.h"
#include "core/skeleton/motion_clip.h"

namespace shaped {

/// An animation as poses.
struct ConvertedClip {
  MotionClip clip;
  double largest_misfit;  ///< m: how far a joint of the clip stands from the file's, at most
};

/// What the animation makes of the rig.
struct ClipConverter {
  const aiScene& scene;
  const std::vector<SceneJoint>& joints;
  const BoundPose& bound;
  const Skeleton& skeleton;
  double metres_per_unit, rate_hz;
  double largest_misfit;  ///< m, beyond which a clip is refused

  /// Throws InvalidInput naming the joint and the frame: it is scaled or stretched, or stands nowhere; also when the
  /// animation morphs the mesh or is too long.
  ConvertedClip convert(const aiAnimation& animation) const;
};

}  // namespace shaped
