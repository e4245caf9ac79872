#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/markers/marker_trial.h"

namespace shaped {

/// Reads a marker trial, chosen by the extension: .c3d (readC3d), .trc (readTrc), .csv (readMarkerCsv) or .npy, an
/// array of n x L x 3 metres with NaN where a marker was not seen. An .npy file has no labels: pass those of the marker
/// set in the order of the array; for other files `npy_labels` is ignored.
/// Throws InvalidInput naming the file (and line) when it cannot be opened or is not what its format asks for.
MarkerTrial readMarkers(const std::filesystem::path& path, std::span<const std::string> npy_labels = {});

/// Writes .trc (millimetres), .csv (metres) or .npy (floats, metres, no labels and no rate); the file appears only when
/// complete. Throws InvalidInput for another extension, for no frames or markers, for a frame of another size and for a
/// label that the format cannot hold (empty, with a comma, quote, # or control character, or with a blank at an end);
/// FileError when writing fails.
void writeMarkers(const std::filesystem::path& path, const MarkerTrial& trial);

/// Motion capture mostly has z up; models have y up: (x, y, z) -> (x, z, -y) in every frame.
void turnZUpToYUp(MarkerTrial& trial);

}  // namespace shaped
