#include "core/rendering/gif.h"

#include <gif_lib.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstring>

#include "core/numerics/error.h"

using namespace shaped;
using Catch::Contains;

namespace {

struct Reading {
  const std::string& bytes;
  std::size_t at = 0;
};

int readSome(GifFileType* file, GifByteType* into, int count) {
  auto& reading = *static_cast<Reading*>(file->UserData);
  const auto size = std::min(static_cast<std::size_t>(count), reading.bytes.size() - reading.at);
  std::memcpy(into, reading.bytes.data() + reading.at, size);
  reading.at += size;
  return static_cast<int>(size);
}

/// Left half one colour, right half another.
Image halves(const Color& left, const Color& right) {
  Image image(20, 10);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) image.blend(x, y, x < 10 ? left : right);
  return image;
}

}  // namespace

TEST_CASE("an animated GIF comes back with its frames, colours and times, and repeats for ever") {
  const Color red(1, 0, 0), blue(0, 0, 1), grey(0.5f, 0.5f, 0.5f);
  const auto bytes = encodeGif({halves(red, blue), halves(grey, blue), halves(blue, red)}, 0.04);
  CHECK(bytes.substr(0, 6) == "GIF89a");
  CHECK(bytes.find("NETSCAPE2.0") != std::string::npos);
  CHECK(bytes.back() == ';');
  Reading reading{bytes};
  int error = 0;
  GifFileType* file = DGifOpen(&reading, &readSome, &error);
  REQUIRE(file != nullptr);
  REQUIRE(DGifSlurp(file) == GIF_OK);
  REQUIRE(file->ImageCount == 3);
  CHECK(file->SWidth == 20);
  CHECK(file->SHeight == 10);
  const auto color = [&](int frame, int x) {
    const auto& shown = file->SColorMap->Colors[file->SavedImages[frame].RasterBits[5 * 20 + x]];
    return std::array<int, 3>{shown.Red, shown.Green, shown.Blue};
  };
  const auto near = [](const std::array<int, 3>& a, const std::array<int, 3>& b) {
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) < 12;
  };
  CHECK(near(color(0, 3), {255, 0, 0}));
  CHECK(near(color(0, 15), {0, 0, 255}));
  CHECK(near(color(1, 3), {128, 128, 128}));
  CHECK(near(color(2, 15), {255, 0, 0}));
  GraphicsControlBlock control;
  REQUIRE(DGifSavedExtensionToGCB(file, 1, &control) == GIF_OK);
  CHECK(control.DelayTime == 4);
  DGifCloseFile(file, nullptr);
}

TEST_CASE("what makes no GIF is refused by name") {
  CHECK_THROWS_WITH(encodeGif({}, 0.1), Contains("frames"));
  CHECK_THROWS_WITH(encodeGif({Image(0, 4)}, 0.1), Contains("0 x 4"));
  CHECK_THROWS_WITH(encodeGif({Image(4, 4), Image(4, 5)}, 0.1), Contains("differ in size"));
  CHECK_THROWS_WITH(encodeGif({Image(4, 4)}, 0), Contains("seconds"));
  CHECK_THROWS_WITH(encodeGif({Image(4, 4)}, 1000), Contains("seconds"));
}
