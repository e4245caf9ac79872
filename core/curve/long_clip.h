#pragma once

#include <cstdint>
#include <functional>

#include "core/curve/smoothing.h"

namespace shaped {

/// A clip that need not fit in memory: its frames one by one, from any thread one at a time.
struct FrameSource {
  std::int64_t frames = 0;
  std::function<Vertices(std::int64_t index)> frame;  ///< V x 3; what it throws passes through
};

/// Receives the frames of the answer in order; what it throws passes through and ends the work.
using FrameSink = std::function<void(std::int64_t index, const Vertices& frame)>;

struct LongClipOptions {
  std::int64_t window = 160;  ///< frames that are smoothed at once, >= 8; a clip with no more is smoothed whole
  /// In which both windows' answers are blended, >= 1.
  std::int64_t blend = 4;
  bool closed = false;         ///< the first frame follows the last; such a clip is smoothed whole
  SmoothingOptions smoothing;  ///< restore and held: of all frames, or empty

  std::optional<std::string> firstViolation(std::int64_t frames) const;
};

struct LongClipReport {
  std::int64_t windows = 0;
  int steps = 0;               ///< the fewest that a window took
  Eigen::Index dimension = 0;  ///< of the last window's subspace; 0: full resolution
  bool stationary = true;
  double smallest_area_ratio = 1;                        ///< over all frames, against the frame as it came
  double path_energy_before = 0, path_energy_after = 0;  ///< (4) of the whole clip [m^2]
  std::vector<double> gradient_before, gradient_after;   ///< gradientNorms() of the whole clip
  /// (4) before the first step and after each one where one window saw the clip, on the mesh that the flow ran on; else
  /// empty [m^2].
  std::vector<double> step_energies;
};

/// Frames further from a frame than this change nothing that can be seen in it: a step of the flow is a step of heat in
/// time with variance tau, so after n of them four standard deviations are 4 sqrt(n tau); never more than n frames,
/// since a step couples neighbours alone.
std::int64_t flowReach(int steps, double tau);

/// Smooths a clip, an open one in overlapping windows, so that memory does not grow with its length. Each window brings
/// flowReach() frames more on either side, so that what its ends hold does not reach the frames it answers for; around
/// the border of two windows, whose subspaces differ, the answer passes from one to the other.
///
/// The outcome adds up the windows'. Cancelled: no more frames were handed on. Throws as smoothed(), and InvalidInput
/// naming "options", or "frames" when the source has none.
Solved<LongClipReport> smoothLongClip(const ShellStructurePtr& structure, double bending, const FrameSource& source,
                                      const LongClipOptions& options, const FrameSink& sink,
                                      const ProgressSink& progress = {});

}  // namespace shaped
