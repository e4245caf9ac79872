#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace shaped::shapectl {

/// Frame indices of "a:b:step" as Python slices: from a to before b; parts may be left out, negative a and b count from
/// the end. Empty text: all frames. Throws InvalidInput naming "--frames" when it is none of that or selects nothing.
std::vector<std::int64_t> framesOf(const std::string& range, std::int64_t frame_count);

/// The frames, or `most` evenly spaced ones of them with the first and the last when there are more. most >= 2.
std::vector<std::int64_t> thinned(const std::vector<std::int64_t>& frames, std::int64_t most);

}  // namespace shaped::shapectl
