#pragma once

#include "core/curve/curve.h"

namespace shaped {

// Filters of vertex trajectories, which know nothing of the shapes: what the smoothing flow is compared with. They
// shrink what turns and bend what is straight.

/// `steps` times: every free frame becomes (1 - tau) of itself and tau / 2 of each neighbour, vertex by vertex. The
/// ends of an open curve stay. tau in (0, 1].
Curve averagedLinearly(const Curve& curve, int steps, double tau);

/// Each vertex of each frame becomes a mean over the frames around it, with weights that fall with the time between
/// them and with the vertex's way (bilateral filtering of trajectories, [VBMP08] as [BvTH16] compares with): exp(-k^2 /
/// (2 frames^2) - |x_i+k - x_i|^2 / (2 distance^2)). frames: in frames, > 0; distance: in metres, > 0, infinity for a
/// Gaussian filter. Frames beyond the ends of an open curve have no weight.
Curve filteredBilaterally(const Curve& curve, double frames, double distance);

}  // namespace shaped
