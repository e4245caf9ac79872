#pragma once

#include <string>
#include <string_view>

#include "core/rendering/image.h"

namespace shaped {

/// Height of a line of text in font dots, descenders and spacing included.
inline constexpr int kTextLineHeight = 11;

/// Width of the text in font dots; a character takes six.
int textWidth(std::string_view text);

/// Draws one line in a fixed-width 5 x 7 dot font, left and top at (x, y), a dot being dot_size x dot_size pixels.
/// Characters outside printable ASCII are drawn as '?'; what falls outside the image is left out.
void drawText(Image& image, int x, int y, std::string_view text, int dot_size, const Color& color);

/// The text itself, or its end after ".." when it is wider than max_dots: file names differ at their ends.
std::string fittedText(std::string_view text, int max_dots);

}  // namespace shaped
