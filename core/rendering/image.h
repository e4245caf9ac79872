#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

namespace shaped {

/// A colour, red green blue in [0, 1], as shown on a screen (sRGB).
using Color = Eigen::Vector3f;

/// A picture: height x width pixels, rows from the top, 8 bits for each of red, green and blue.
class Image {
 public:
  Image() = default;
  /// White. width, height: pixels, >= 0.
  Image(int width, int height)
      : width_(width),
        height_(height),
        bytes_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3, 255) {}

  int width() const { return width_; }
  int height() const { return height_; }

  /// The three bytes of a pixel; x in [0, width), y in [0, height) from the top.
  std::uint8_t* at(int x, int y) { return bytes_.data() + offset(x, y); }
  const std::uint8_t* at(int x, int y) const { return bytes_.data() + offset(x, y); }

  /// Mixes a colour over a pixel, opacity in [0, 1]; pixels outside the image are left out.
  void blend(int x, int y, const Color& color, float opacity = 1) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    std::uint8_t* pixel = at(x, y);
    for (int c = 0; c < 3; ++c) {
      const float mixed = opacity * color[c] + (1 - opacity) * static_cast<float>(pixel[c]) / 255.0f;
      pixel[c] = static_cast<std::uint8_t>(std::min(std::max(mixed, 0.0f), 1.0f) * 255.0f + 0.5f);
    }
  }

 private:
  std::size_t offset(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)) * 3;
  }

  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace shaped
