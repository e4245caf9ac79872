#pragma once

#include <string>

#include "core/rendering/image.h"

namespace shaped {

/// The bytes of an 8-bit RGB PNG file. Throws InvalidInput for an image without pixels.
std::string encodePng(const Image& image);

}  // namespace shaped
