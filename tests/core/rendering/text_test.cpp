#include "core/rendering/text.h"

#include <catch2/catch.hpp>
#include <set>
#include <string>

using namespace shaped;

namespace {

/// The bytes of a picture of the text alone.
std::string drawn(const std::string& text) {
  Image image(6 * static_cast<int>(text.size()), kTextLineHeight);
  drawText(image, 0, 0, text, 1, Color::Zero());
  return std::string(image.at(0, 0), image.at(0, 0) + 3 * image.width() * image.height());
}

}  // namespace

TEST_CASE("every printable character has a glyph of its own") {
  std::set<std::string> glyphs;
  for (char c = 32; c < 127; ++c) glyphs.insert(drawn(std::string(1, c)));
  CHECK(glyphs.size() == 95);
}

TEST_CASE("characters outside ASCII become question marks, and drawing stops at the border") {
  CHECK(drawn("\xc3") == drawn("?"));
  Image image(8, 8);
  drawText(image, -3, 5, "WWWWWW", 2, Color::Zero());
  CHECK(image.at(0, 0)[0] == 255);
}

TEST_CASE("a text too wide keeps its end") {
  CHECK(fittedText("short", 60) == "short");
  CHECK(fittedText("horse_Head_But_03", 60) == "..d_But_03");
  CHECK(textWidth(fittedText("horse_Head_But_03", 60)) <= 60);
  CHECK(fittedText("abc", 6) == "a");
}
