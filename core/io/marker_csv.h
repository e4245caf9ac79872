#pragma once

#include <string>
#include <string_view>

#include "core/markers/marker_trial.h"

namespace shaped {

/// Parses markers as comma-separated values:
///   # units: mm          (optional, before the header; default m)
///   # rate: 120          (optional; or a column "time" in seconds)
///   frame,time,LFWT_x,LFWT_y,LFWT_z,RFWT_x,...
///   1,0.000,102.5,33,941.25,,,
/// The first column is "frame" and counts up by one; "time" is optional; each label has its columns _x, _y, _z one
/// after the other. A marker was not seen where its three fields are blank or NaN. Other lines that begin with # are
/// comments. file: the name for error texts. Throws InvalidInput naming file and line.
MarkerTrial parseMarkerCsv(const std::string& file, std::string_view text);

/// The trial in that form, in metres; reads back exactly.
std::string formatMarkerCsv(const MarkerTrial& trial);

}  // namespace shaped
