#pragma once

#include <span>
#include <vector>

#include "core/registration/limb_search.h"

namespace shaped {

/// Puts a joint, and all that hangs below it, at rest.
void straighten(const Skeleton& skeleton, std::int32_t joint, Pose& pose);

/// Other ways in which one limb may stand, where a descent may have turned it the wrong way round (a hand palm up, a
/// foot heel first): what hangs below its lower joint at rest; the same with the upper bone not twisted about itself;
/// and as the limb stands in each of some other poses, as those of frames nearby. rest_joints: J x 3.
std::vector<Pose> otherLimbPoses(const Skeleton& skeleton, const Vertices& rest_joints, const Limb& limb,
                                 const Pose& pose, std::span<const Pose> others);

}  // namespace shaped
