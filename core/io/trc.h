#pragma once

#include <string>
#include <string_view>

#include "core/markers/marker_trial.h"

namespace shaped {

/// Parses a TRC file (Motion Analysis, OpenSim): lines of tab-separated fields.
///   1     PathFileType ...                              2, 3  names and values: DataRate, NumFrames, NumMarkers, Units
///   4     Frame#, Time, then a label every three fields  5    X1, Y1, Z1, ...
///   then one row a frame. A marker was not seen where its three fields are blank, NaN or 0.
/// file: the name for error texts. Throws InvalidInput naming file and line when a header field is missing, the counts
/// do not match the labels or rows, or a field is no number.
MarkerTrial parseTrc(const std::string& file, std::string_view text);

/// The trial as a TRC file in millimetres.
std::string formatTrc(const MarkerTrial& trial);

}  // namespace shaped
