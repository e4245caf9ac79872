#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/mesh/types.h"
#include "core/mocap/marker_tracker.h"
#include "core/model/model_point.h"
#include "core/numerics/solved.h"

namespace shaped {

struct TakeOptions {
  int modes = 0;            ///< J to use, 0 = all of the model's
  double prior_weight = 1;  ///< of the model against the markers, > 0
  double robust_scale =
      0.05;  ///< distance at which a marker's pull is quartered, over the model's size; 0 = least squares
  std::optional<double> scale;  ///< size of the subject over that of the model; estimated where not given
  std::stop_token stop = {};
};

/// A frame of a take as the model sees it.
struct TakeFrame {
  Vertices shape;  ///< V x 3, placed and scaled as the markers
  ModelPoint point;
  Eigen::VectorXd residuals;       ///< per marker, distance to its point on the shape [m]; NaN where not seen
  double rms = 0;                  ///< over the markers seen [m]
  double scale = 1;                ///< of the model
  bool held = false;               ///< too few markers were seen: the last frame's shape is repeated
  double smallest_area_ratio = 1;  ///< of the unscaled shape against the mean
};

/// Fits one take of markers, frame by frame, each started from the last. One object per take and thread.
class TakeFitter {
 public:
  virtual ~TakeFitter() = default;

  /// Learns of the subject what stays the same, from several frames, before the first fit(). Throws InvalidInput naming
  /// calibration[i].
  virtual Outcome calibrate(const std::vector<MarkerPositions>& frames) = 0;
  /// Fits the next frame: L x 3 [m], a row of NaN for a marker that was not seen. Throws InvalidInput naming "markers"
  /// when it has not L rows, or is the first and does not show enough to place the model.
  virtual Solved<TakeFrame> fit(const MarkerPositions& markers) = 0;

  /// Writes a state, and that it came after so many frames. The file appears only when complete. Throws FileError.
  using Keep = std::function<void(const std::filesystem::path& path, std::int64_t frames)>;
  /// Keeps the state as it is at this moment, whenever it is called.
  virtual Keep state() const = 0;
  /// Goes on from a file that such a call has written, of a fitter with the same model, markers and options; returns
  /// the number of frames. Throws InvalidInput naming the file when it is damaged, of another format, or no such state.
  virtual std::int64_t resume(const std::filesystem::path& path) = 0;
};

}  // namespace shaped
