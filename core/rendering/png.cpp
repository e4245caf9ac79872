#include "core/rendering/png.h"

#include <png.h>

#include <new>

#include "core/numerics/error.h"

namespace shaped {

std::string encodePng(const Image& image) {
  if (image.width() < 1 || image.height() < 1) throw InvalidInput("image", "has no pixels, so it makes no picture");
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  description.width = static_cast<png_uint_32>(image.width());
  description.height = static_cast<png_uint_32>(image.height());
  description.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(description);  // one pass into the largest size it can have
  std::string bytes(size, '\0');
  // With pixels given and room enough, libpng fails for want of memory only.
  if (!png_image_write_to_memory(&description, bytes.data(), &size, 0, image.at(0, 0), 0, nullptr))
    throw std::bad_alloc();
  bytes.resize(size);
  return bytes;
}

}  // namespace shaped
