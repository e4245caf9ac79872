#include "client/shapectl/frame_range.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>

#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

[[noreturn]] void fail(const std::string& range, const std::string& problem) {
  throw InvalidInput("--frames", "\"" + range + "\" " + problem);
}

std::int64_t numberOf(const std::string& range, const std::string& part) {
  std::int64_t number = 0;
  const auto* end = part.data() + part.size();
  const auto [stopped, error] = std::from_chars(part.data(), end, number);
  if (error != std::errc() || stopped != end) fail(range, "is no range; want a:b:step, a:b or a:");
  return number;
}

}  // namespace

std::vector<std::int64_t> framesOf(const std::string& range, std::int64_t frame_count) {
  std::array<std::int64_t, 3> parts{0, frame_count, 1};
  std::istringstream text(range);
  std::size_t given = 0;
  for (std::string part; std::getline(text, part, ':'); ++given) {
    if (given == parts.size()) fail(range, "has more than three parts");
    if (!part.empty()) parts[given] = numberOf(range, part);
  }
  if (given == 1 && range.find(':') == std::string::npos) parts[1] = parts[0] + 1;  // one frame
  auto [begin, end, step] = parts;
  if (step < 1) fail(range, "has a step below 1");
  if (begin < 0) begin += frame_count;
  if (end < 0) end += frame_count;
  std::vector<std::int64_t> frames;
  for (auto frame = std::max<std::int64_t>(begin, 0); frame < std::min(end, frame_count); frame += step)
    frames.push_back(frame);
  if (frames.empty()) fail(range, "selects none of the " + std::to_string(frame_count) + " frames");
  return frames;
}

std::vector<std::int64_t> thinned(const std::vector<std::int64_t>& frames, std::int64_t most) {
  const auto count = static_cast<std::int64_t>(frames.size());
  if (count <= most) return frames;
  std::vector<std::int64_t> result;
  for (std::int64_t i = 0; i < most; ++i)
    result.push_back(frames[static_cast<std::size_t>(i * (count - 1) / (most - 1))]);
  return result;
}

}  // namespace shaped::shapectl
