#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/markers/marker_trial.h"

namespace shaped {

/// Reads the points of a C3D file (c3d.org user guide): Intel, DEC and SGI/MIPS numbers, integers with POINT:SCALE or
/// floats, POINT:UNITS mm (also when absent), cm, dm, m, in or ft, any number of points (POINT:LABELS, LABELS2, ...)
/// and frames (TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD, POINT:LONG_FRAMES, POINT:FRAMES). Analog channels are
/// skipped. A point was not seen where its residual is negative, all its coordinates are zero or one is no number. A
/// point without a label is called "unlabelled_<number from 1>". Vendors store computed angles and forces as points
/// too: choose by label.
///
/// Throws InvalidInput naming the file when it is no C3D file, is truncated, when header and parameters disagree about
/// the number of points or frames, or when they do not match the data; the text then says how many frames are there.
MarkerTrial readC3d(const std::filesystem::path& path);

/// The same from the bytes of a file; file: its name for error texts.
MarkerTrial parseC3d(const std::string& file, std::string_view bytes);

}  // namespace shaped
