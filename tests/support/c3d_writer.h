#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/io/c3d_numbers.h"
#include "core/markers/marker_trial.h"

namespace shaped::test {

/// How a C3D file is written, faults included.
struct C3dOptions {
  C3dProcessor processor = C3dProcessor::kIntel;
  double scale = -1;              ///< file units per stored integer; negative: floats
  std::string units = "mm";       ///< empty: no POINT:UNITS
  double units_per_metre = 1000;  ///< what `units` means
  int analog_values = 0;          ///< per frame, filled with junk
  int first_frame = 1;
  std::size_t labels_per_parameter = 255;
  bool missing_by_zero = false;  ///< a missing point has zeros and a good residual; otherwise junk and residual -1
  bool trial_group = false;      ///< TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD
  bool long_frames = false;      ///< POINT:LONG_FRAMES
  std::optional<int> header_last_frame, point_frames, point_used;  ///< lies
};

/// The bytes of a C3D file with the trial's points (metres; NaN is missing).
std::string formatC3d(const MarkerTrial& trial, const C3dOptions& options = {});

}  // namespace shaped::test
