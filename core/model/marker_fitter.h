#pragma once

#include "core/mocap/marker_tracker.h"
#include "core/model/shell_pga_model.h"

namespace shaped {

/// A fitted frame at full resolution.
struct FittedFrame {
  Vertices shape;                  ///< V x 3, placed and scaled as the markers
  MarkerFit fit;                   ///< residuals, weights, scale, coarse shapes
  double smallest_area_ratio = 1;  ///< of the unscaled shape against the mean
};

/// Fits a marker sequence with a model, frame by frame, each started from the last (MarkerTracker). Holds the model;
/// one object per sequence and thread.
class MarkerFitter {
 public:
  /// Throws InvalidInput when a marker does not fit the model's topology, there are fewer than three, or an option is
  /// out of range.
  MarkerFitter(ShellPgaModelPtr model, const MarkerSet& markers, const MarkerTrackerOptions& options);

  /// Estimates the subject's size from several frames, as MarkerTracker::calibrate.
  Outcome calibrate(const std::vector<MarkerPositions>& frames) { return tracker_.calibrate(frames); }

  /// Fits the next frame: L x 3 [m], a row of NaN for a marker that was not seen. Throws as MarkerTracker::fit.
  Solved<FittedFrame> fit(const MarkerPositions& markers);

  /// As MarkerTracker::state and MarkerTracker::resume.
  MarkerTrackerState state() const { return tracker_.state(); }
  void resume(MarkerTrackerState state) { tracker_.resume(std::move(state)); }

 private:
  ShellPgaModelPtr model_;
  MarkerTracker tracker_;
};

}  // namespace shaped
