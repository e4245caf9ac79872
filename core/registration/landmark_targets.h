#pragma once

#include <vector>

#include "core/body/body_fit.h"
#include "core/registration/landmark.h"

namespace shaped {

/// Landmarks as targets for fitBody, their weights scaled to sum to `weight`. Throws InvalidInput naming `landmarks[i]`
/// when its face is not the model's or a number is not finite.
std::vector<SurfaceTarget> landmarkTargets(const std::vector<Landmark>& landmarks, const Faces& faces, double weight);

}  // namespace shaped
