#include "server/scheduling/order.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace shaped::server {
namespace {

/// The class that a line has by now, 0 the most urgent.
double classOf(const Line& line, double ageing) {
  return std::max(0.0, static_cast<double>(line.priority) - std::floor(line.waited / ageing));
}

}  // namespace

std::size_t next(const std::vector<Line>& lines, double ageing) {
  const auto rank = [ageing](const Line& line) {
    return std::tuple(classOf(line, ageing), line.running, line.served, -line.waited);
  };
  const auto first =
      std::min_element(lines.begin(), lines.end(), [&](const Line& a, const Line& b) { return rank(a) < rank(b); });
  return static_cast<std::size_t>(first - lines.begin());
}

}  // namespace shaped::server
