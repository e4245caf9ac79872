#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/io/asf.h"
#include "core/skeleton/motion_clip.h"

namespace shaped {

/// Reads an AMC motion of the skeleton in Acclaim's format: for every frame its number, then a line of numbers for each
/// bone that may turn. Angles are in degrees or radians as the file says, or else as the skeleton's are.
/// rate_hz: frames a second, > 0; the file does not say (CMU: 120).
///
/// Throws InvalidInput naming the file and line when the file cannot be opened, breaks the format, the frames are not
/// numbered one after the other, a bone is unknown, named twice or missing in a frame, or has too few or too many
/// numbers or one that is not finite; `rate_hz` when it is not above 0.
MotionClip readAmc(const std::filesystem::path& path, const AcclaimSkeleton& skeleton, double rate_hz);

/// The same from text; file: its name for error texts.
MotionClip parseAmc(const std::string& file, std::string_view text, const AcclaimSkeleton& skeleton, double rate_hz);

}  // namespace shaped
