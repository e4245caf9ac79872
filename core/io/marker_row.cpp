#include "core/io/marker_row.h"

#include <limits>

namespace shaped {

Vertices parseMarkerRow(const TextScanner& scanner, std::span<const std::string_view> fields,
                        const std::vector<std::string>& labels, double metres, bool zero_is_missing) {
  const auto marker_count = static_cast<Eigen::Index>(labels.size());
  while (!fields.empty() && fields.back().empty()) fields = fields.first(fields.size() - 1);
  if (fields.size() > 3 * labels.size())
    scanner.fail("has " + std::to_string(fields.size()) + " coordinates, want " + std::to_string(3 * labels.size()) +
                 " for " + std::to_string(labels.size()) + " markers");
  constexpr double missing = std::numeric_limits<double>::quiet_NaN();
  Vertices frame = Vertices::Constant(marker_count, 3, missing);
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (!fields[i].empty())
      frame(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) =
          metres * scanner.numberIn(fields[i], "a coordinate of " + quotedWord(labels[i / 3]));
  for (Eigen::Index m = 0; m < marker_count; ++m) {
    if (frame.row(m).array().isNaN().all() || frame.row(m).allFinite()) {
      if (zero_is_missing && frame.row(m).isZero(0)) frame.row(m).setConstant(missing);
      continue;
    }
    scanner.fail("marker " + quotedWord(labels[static_cast<std::size_t>(m)]) +
                 " has finite and missing coordinates in one frame");
  }
  return frame;
}

void requireFilledRows(const TextScanner& scanner, std::size_t rows, std::size_t labels, std::size_t bytes) {
  constexpr std::size_t most_omitted = 1 << 24;
  // A field that is there, blank or not, is followed by a separator: it takes a byte at least.
  if (rows * labels * 3 > bytes + most_omitted)
    scanner.fail("rows of " + std::to_string(labels) + " markers leave out more than " + std::to_string(most_omitted) +
                 " fields at their ends; write their separators");
}

}  // namespace shaped
