#pragma once

#include <string>
#include <vector>

#include "core/rendering/image.h"

namespace shaped {

/// The bytes of an animated GIF file (89a) that repeats for ever. The frames share one palette of 256 colours, chosen
/// for all of them, so that what does not move does not flicker.
///
/// frames: at least one, all of one size, at most 65535 pixels wide and high. seconds: that each one is shown, rounded
/// to hundredths, at least two of them (what viewers do not slow down). Throws InvalidInput naming "frames" or
/// "seconds".
std::string encodeGif(const std::vector<Image>& frames, double seconds);

}  // namespace shaped
