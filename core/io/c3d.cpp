#include "core/io/c3d.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/io/c3d_numbers.h"
#include "core/io/c3d_parameters.h"
#include "core/io/file.h"
#include "core/io/length_unit.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::size_t kBlock = 512;
constexpr std::int64_t kLargestWord = 65535;  ///< stands for "this or more" in a count

/// The first block of the file, as far as points need it.
struct Header {
  std::int64_t points, analog_values, first_frame, last_frame, data_block;
  double scale, rate;
};

/// Where the data lie and how.
struct Layout {
  std::int64_t points, frames;
  std::size_t begin, point_bytes, frame_bytes;
  double scale;  ///< file units per stored integer; 0: floats in file units
};

std::size_t parameterSection(const std::string& file, std::string_view bytes) {
  if (bytes.size() < kBlock) throw InvalidInput(file, "is truncated: a C3D header has 512 bytes");
  if (static_cast<unsigned char>(bytes[1]) != 0x50)
    throw InvalidInput(file, "is no C3D file: its second byte is not 0x50");
  const auto block = static_cast<unsigned char>(bytes[0]);
  if (block == 0) throw InvalidInput(file, "is no C3D file: its parameters are in no block");
  const auto begin = (block - 1) * kBlock;
  if (begin + 4 > bytes.size()) throw InvalidInput(file, "is truncated: ends before its parameters");
  return begin;
}

C3dProcessor processorOf(const std::string& file, char code) {
  const auto value = static_cast<std::uint8_t>(code);
  if (value < 84 || value > 86)
    throw InvalidInput(file, "has the unknown processor type " + std::to_string(value) +
                                 "; want 84 (Intel), 85 (DEC) or 86 (SGI/MIPS)");
  return static_cast<C3dProcessor>(value);
}

Header readHeader(std::string_view bytes, const C3dNumbers& numbers) {
  const auto word = [&](std::size_t number) { return std::int64_t{numbers.word(bytes.data() + 2 * (number - 1))}; };
  return {
      word(2), word(3), word(4), word(5), word(9), numbers.real(bytes.data() + 12), numbers.real(bytes.data() + 20)};
}

/// A 32-bit count in two 16-bit words, the low one first.
std::optional<std::int64_t> longCount(const C3dParameters& parameters, std::string_view name) {
  const auto low = parameters.count("TRIAL", name, 0);
  if (!low) return std::nullopt;
  return *low + 65536 * parameters.count("TRIAL", name, 1).value_or(0);
}

struct Claim {
  std::string source;
  std::int64_t frames;
};

/// Every statement about the number of frames that is not saturated at the largest 16-bit number.
std::vector<Claim> frameClaims(const Header& header, const C3dParameters& parameters) {
  std::vector<Claim> claims;
  const auto begin = longCount(parameters, "ACTUAL_START_FIELD"), end = longCount(parameters, "ACTUAL_END_FIELD");
  if (begin && end) claims.push_back({"TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD", *end - *begin + 1});
  for (const auto* name : {"LONG_FRAMES", "FRAMES"}) {
    const auto count = parameters.count("POINT", name);
    if (count && *count != kLargestWord) claims.push_back({std::string("POINT:") + name, *count});
  }
  if (header.last_frame != kLargestWord) claims.push_back({"the header", header.last_frame - header.first_frame + 1});
  if (claims.empty()) claims.push_back({"POINT:FRAMES", kLargestWord});
  return claims;
}

/// Whether the bytes behind the promised frames are more than the filling of a block.
bool holdsMore(std::string_view behind) {
  return behind.size() >= kBlock && behind.find_first_not_of('\0') != std::string_view::npos;
}

std::int64_t frameCount(const std::string& file, const std::vector<Claim>& claims, std::string_view data,
                        std::size_t frame_bytes) {
  const auto there = static_cast<std::int64_t>(data.size() / frame_bytes);
  for (const auto& claim : claims) {
    if (claim.frames != claims.front().frames)
      throw InvalidInput(file, "contradicts itself: " + claims.front().source + " promises " +
                                   std::to_string(claims.front().frames) + " frames, " + claim.source + " " +
                                   std::to_string(claim.frames) + "; there are data for " + std::to_string(there));
  }
  const auto promised = claims.front().frames;
  if (promised < 1) throw InvalidInput(file, "promises " + std::to_string(promised) + " frames; want at least 1");
  if (promised > there)
    throw InvalidInput(file, "is truncated: " + claims.front().source + " promises " + std::to_string(promised) +
                                 " frames, " + std::to_string(there) + " are there");
  if (holdsMore(data.substr(static_cast<std::size_t>(promised) * frame_bytes)))
    throw InvalidInput(file, claims.front().source + " promises " + std::to_string(promised) + " frames, but " +
                                 std::to_string(there) + " are there");
  return promised;
}

Layout layoutOf(const std::string& file, std::string_view bytes, const Header& header,
                const C3dParameters& parameters) {
  Layout layout{};
  layout.points = header.points;
  const auto used = parameters.number("POINT", "USED");
  if (used && *used != static_cast<double>(header.points))
    throw InvalidInput(file, "contradicts itself: the header promises " + std::to_string(header.points) +
                                 " points, POINT:USED " + shortest(*used));
  if (header.points == 0) throw InvalidInput(file, "has no points");
  const double scale = parameters.number("POINT", "SCALE").value_or(header.scale);
  if (!std::isfinite(scale) || scale == 0) throw InvalidInput(file, "has the scale " + shortest(scale));
  layout.scale = scale > 0 ? scale : 0;
  const std::size_t number_bytes = scale > 0 ? 2 : 4;
  layout.point_bytes = 4 * number_bytes;
  layout.frame_bytes = static_cast<std::size_t>(4 * header.points + header.analog_values) * number_bytes;
  const auto block = parameters.count("POINT", "DATA_START").value_or(0);
  layout.begin =
      static_cast<std::size_t>(std::max<std::int64_t>(block > 1 ? block : header.data_block, 1) - 1) * kBlock;
  if (layout.begin < kBlock) throw InvalidInput(file, "says that its data begin in the header");
  const auto data = bytes.substr(std::min(layout.begin, bytes.size()));
  layout.frames = frameCount(file, frameClaims(header, parameters), data, layout.frame_bytes);
  return layout;
}

/// POINT:LABELS, LABELS2, ... hold at most 255 labels each; those beyond the points are not looked at.
std::vector<std::string> labelsOf(const C3dParameters& parameters, std::int64_t points) {
  const auto wanted = static_cast<std::size_t>(points);
  auto labels = parameters.texts("POINT", "LABELS", wanted);
  for (int part = 2; labels.size() < wanted && parameters.has("POINT", "LABELS" + std::to_string(part)); ++part)
    for (auto& label : parameters.texts("POINT", "LABELS" + std::to_string(part), wanted - labels.size()))
      labels.push_back(std::move(label));
  labels.resize(wanted);
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i].empty()) labels[i] = "unlabelled_" + std::to_string(i + 1);
  return labels;
}

/// One point in metres, or NaN. The fourth number holds the residual and is negative for a point that was not seen.
Eigen::RowVector3d readPoint(const char* at, const Layout& layout, const C3dNumbers& numbers, double metres) {
  std::array<double, 4> value;
  for (std::size_t i = 0; i < 4; ++i)
    value[i] = layout.scale > 0 ? static_cast<double>(numbers.signedWord(at + 2 * i)) : numbers.real(at + 4 * i);
  const Eigen::RowVector3d stored(value[0], value[1], value[2]);
  if (value[3] < 0 || !stored.allFinite() || stored.isZero(0))
    return Eigen::RowVector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return stored * (layout.scale > 0 ? layout.scale * metres : metres);
}

double metresPerUnit(const std::string& file, const C3dParameters& parameters) {
  const auto units = parameters.texts("POINT", "UNITS", 1);
  if (units.empty() || units.front().empty()) return 1e-3;
  if (const auto metres = metresPer(units.front())) return *metres;
  throw InvalidInput(file, "has POINT:UNITS " + quotedWord(units.front()) + "; want mm, cm, dm, m, in or ft");
}

}  // namespace

MarkerTrial parseC3d(const std::string& file, std::string_view bytes) {
  const auto section = parameterSection(file, bytes);
  const C3dNumbers numbers(processorOf(file, bytes[section + 3]));
  // Some programs leave the number of blocks 0; the list then ends by itself.
  const auto blocks = static_cast<unsigned char>(bytes[section + 2]);
  const C3dParameters parameters(file, bytes, section + 4, blocks > 0 ? section + blocks * kBlock : bytes.size(),
                                 numbers);
  const auto header = readHeader(bytes, numbers);
  const auto layout = layoutOf(file, bytes, header, parameters);
  const double metres = metresPerUnit(file, parameters);
  const double rate = parameters.number("POINT", "RATE").value_or(header.rate);
  MarkerTrial trial{labelsOf(parameters, layout.points), std::isfinite(rate) && rate > 0 ? rate : 0, {}};
  trial.frames.reserve(static_cast<std::size_t>(layout.frames));
  for (std::int64_t f = 0; f < layout.frames; ++f) {
    const char* at = bytes.data() + layout.begin + static_cast<std::size_t>(f) * layout.frame_bytes;
    auto& frame = trial.frames.emplace_back(layout.points, 3);
    for (Eigen::Index p = 0; p < frame.rows(); ++p, at += layout.point_bytes)
      frame.row(p) = readPoint(at, layout, numbers, metres);
  }
  return trial;
}

MarkerTrial readC3d(const std::filesystem::path& path) { return parseC3d(path.string(), readFile(path)); }

}  // namespace shaped
