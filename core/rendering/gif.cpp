#include "core/rendering/gif.h"

#include <gif_lib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr int kColors = 256, kLargest = 65535;
constexpr std::size_t kSampledPixels = 1 << 20;  ///< by which the palette is chosen
constexpr double kHundredths = 100, kShortest = 2;

int append(GifFileType* file, const GifByteType* bytes, int count) {
  static_cast<std::string*>(file->UserData)
      ->append(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(count));
  return count;
}

void require(bool fine, int error) {
  if (!fine) throw std::runtime_error(std::string("writing a GIF failed: ") + GifErrorString(error));
}

using ColorMap = std::unique_ptr<ColorMapObject, decltype(&GifFreeMapObject)>;

/// 256 colours for pixels of all frames.
ColorMap paletteOf(const std::vector<Image>& frames) {
  const auto pixels = static_cast<std::size_t>(frames[0].width()) * static_cast<std::size_t>(frames[0].height());
  const std::size_t step = pixels * frames.size() / kSampledPixels + 1;
  std::array<std::vector<GifByteType>, 3> samples;
  for (std::size_t i = 0; i < pixels * frames.size(); i += step) {
    const auto* pixel = frames[i / pixels].at(0, 0) + 3 * (i % pixels);
    for (std::size_t c = 0; c < 3; ++c) samples[c].push_back(pixel[c]);
  }
  std::vector<GifByteType> chosen(samples[0].size());
  ColorMap map(GifMakeMapObject(kColors, nullptr), &GifFreeMapObject);
  require(map != nullptr, E_GIF_ERR_NOT_ENOUGH_MEM);
  int size = kColors;
  require(GifQuantizeBuffer(static_cast<unsigned>(chosen.size()), 1, &size, samples[0].data(), samples[1].data(),
                            samples[2].data(), chosen.data(), map->Colors) == GIF_OK,
          E_GIF_ERR_NOT_ENOUGH_MEM);
  // Fewer colours than asked for leave the rest undefined.
  for (int i = size; i < kColors; ++i) map->Colors[i] = GifColorType{0, 0, 0};
  return map;
}

/// The nearest colour of the palette, looked up once for each colour of 6 bits a channel.
class NearestColor {
 public:
  explicit NearestColor(const ColorMapObject& map) : map_(map), known_(1 << 18, -1) {}

  GifByteType operator()(const std::uint8_t* pixel) {
    const std::size_t key = (std::size_t{pixel[0]} >> 2 << 12) | (std::size_t{pixel[1]} >> 2 << 6) | (pixel[2] >> 2);
    if (known_[key] < 0) known_[key] = search(pixel);
    return static_cast<GifByteType>(known_[key]);
  }

 private:
  int search(const std::uint8_t* pixel) const {
    int best = 0, least = std::numeric_limits<int>::max();
    for (int i = 0; i < kColors; ++i) {
      const auto& color = map_.Colors[i];
      const int r = color.Red - pixel[0], g = color.Green - pixel[1], b = color.Blue - pixel[2];
      if (const int distance = r * r + g * g + b * b; distance < least) least = distance, best = i;
    }
    return best;
  }

  const ColorMapObject& map_;
  std::vector<int> known_;
};

void putLoop(GifFileType* file) {
  const unsigned char for_ever[] = {1, 0, 0};
  require(EGifPutExtensionLeader(file, APPLICATION_EXT_FUNC_CODE) == GIF_OK &&
              EGifPutExtensionBlock(file, 11, "NETSCAPE2.0") == GIF_OK &&
              EGifPutExtensionBlock(file, sizeof for_ever, for_ever) == GIF_OK &&
              EGifPutExtensionTrailer(file) == GIF_OK,
          file->Error);
}

void putFrame(GifFileType* file, const Image& frame, int hundredths, NearestColor& nearest) {
  const GraphicsControlBlock control{DISPOSE_DO_NOT, false, hundredths, NO_TRANSPARENT_COLOR};
  GifByteType extension[4];
  EGifGCBToExtension(&control, extension);
  require(EGifPutExtension(file, GRAPHICS_EXT_FUNC_CODE, sizeof extension, extension) == GIF_OK &&
              EGifPutImageDesc(file, 0, 0, frame.width(), frame.height(), false, nullptr) == GIF_OK,
          file->Error);
  std::vector<GifByteType> row(static_cast<std::size_t>(frame.width()));
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) row[static_cast<std::size_t>(x)] = nearest(frame.at(x, y));
    require(EGifPutLine(file, row.data(), frame.width()) == GIF_OK, file->Error);
  }
}

}  // namespace

std::string encodeGif(const std::vector<Image>& frames, double seconds) {
  if (frames.empty()) throw InvalidInput("frames", "there is none");
  const int width = frames[0].width(), height = frames[0].height();
  if (width < 1 || height < 1 || width > kLargest || height > kLargest)
    throw InvalidInput("frames", "are " + std::to_string(width) + " x " + std::to_string(height) +
                                     " pixels, want 1 to 65535 each way");
  for (const auto& frame : frames)
    if (frame.width() != width || frame.height() != height) throw InvalidInput("frames", "differ in size");
  if (!(seconds > 0 && seconds <= kLargest / kHundredths))
    throw InvalidInput("seconds", "= " + std::to_string(seconds) + ", want above 0, at most 655");
  const auto map = paletteOf(frames);
  NearestColor nearest(*map);
  std::string bytes;
  int error = 0;
  std::unique_ptr<GifFileType, void (*)(GifFileType*)> file(EGifOpen(&bytes, &append, &error),
                                                            [](GifFileType* open) { EGifCloseFile(open, nullptr); });
  require(file != nullptr, error);
  EGifSetGifVersion(file.get(), true);
  require(EGifPutScreenDesc(file.get(), width, height, 8, 0, map.get()) == GIF_OK, file->Error);
  putLoop(file.get());
  const int hundredths = static_cast<int>(std::lround(std::max(seconds * kHundredths, kShortest)));
  for (const auto& frame : frames) putFrame(file.get(), frame, hundredths, nearest);
  require(EGifCloseFile(file.release(), &error) == GIF_OK, error);
  return bytes;
}

}  // namespace shaped
