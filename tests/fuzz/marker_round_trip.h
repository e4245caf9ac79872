#pragma once

#include <string>
#include <string_view>

#include "core/markers/marker_trial.h"

namespace shaped::fuzz {

/// Throws Broken unless every frame has a row for every label, each row is finite or NaN throughout, and the rate is 0
/// or a positive number.
void requireTrial(const MarkerTrial& trial);

/// Reads the bytes as a marker file of this extension (".trc") for as many labels as a .npy file has markers. The trial
/// must be sound; written in `written` ("": not at all) it must read back, exactly or to the rounding of millimetres.
void readAndRewriteMarkers(std::string_view bytes, const std::string& extension, const std::string& written);

}  // namespace shaped::fuzz
