#pragma once

#include "core/registration/scan_to_model.h"

namespace shaped {

/// A single body in a pose.
struct PosedBody {
  BodyModel body;   ///< its mean is the body at rest; its one mode is left alone
  BodyState state;  ///< the identity is zero

  Vertices posed() const { return body.posed(state).vertices(); }
};

/// How far a pose is fitted anew.
enum class PoseRefit {
  kRough,  ///< by the last level but one of the options: near enough to see what is where
  kFine,   ///< by the last level: what a rough fit began
  kFull    ///< by the last two levels
};

/// A body of the model's rig that stands as it is, in a pose near by: the pose alone is fitted to the scan. rest: V x
/// 3, in the model's rest pose. Throws InvalidInput naming what does not fit.
PosedBody refitPose(const BodyModel& model, const Vertices& rest, const Pose& near, const ScanSurface& scan,
                    const ModelFitOptions& options, PoseRefit how);

}  // namespace shaped
