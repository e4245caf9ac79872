#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/skeleton/motion_clip.h"

namespace shaped {

/// Reads a BVH motion (Biovision; M. Meredith, S. Maddock, "Motion Capture File Formats Explained", 2001). Its joints
/// turn as ours do: frames aligned with the world's axes at rest, R = the product of a joint's channels in the order in
/// which CHANNELS lists them. End sites are no joints. metres_per_unit: of the file's lengths, > 0 (BVH does not say;
/// see metresPer; CMU's clips: 0.0254 / 0.45).
/// A position channel says where the root joint is, in place of its OFFSET. Other joints may have position channels as
/// long as they stay where they are: at the OFFSET or at 0 (a shift from it, as MakeHuman writes) in every frame,
/// within 1e-3 of the longest OFFSET. A frame time within 1e-4 of that of a whole rate, which is how rates are written
/// short, gives that rate.
///
/// Throws InvalidInput naming the file and line when the file cannot be opened, breaks the format, has a joint's name
/// twice, an unknown channel, a row of too few or too many numbers, one that is not finite, more or fewer frames than
/// it promises, or a joint other than the root moves away; with a metres_per_unit that is not above 0.
MotionClip readBvh(const std::filesystem::path& path, double metres_per_unit);

/// The same from text; file: its name for error texts.
MotionClip parseBvh(const std::string& file, std::string_view text, double metres_per_unit);

/// Writes the clip with channels Zrotation Yrotation Xrotation, the root's position before them, and joints depth
/// first: a reader gets them in that order. Rotations read back within rounding. Throws InvalidInput when the clip has
/// no frames, a pose does not fit the skeleton, a name holds blanks at its ends, line ends or braces, or rate_hz or
/// metres_per_unit is not above 0; FileError when writing fails.
void writeBvh(const std::filesystem::path& path, const MotionClip& clip, double metres_per_unit);

}  // namespace shaped
