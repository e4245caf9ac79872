#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/text_scanner.h"
#include "core/mesh/types.h"

namespace shaped {

/// One frame of a marker table from its coordinate fields, three a marker: L x 3, multiplied by `metres`, NaN where all
/// three fields are blank or NaN, or, when zero_is_missing, 0. Missing fields at the end of the row count as blank.
/// Fails at the scanner's line when there are too many fields, a field is no number or only a part of a marker is
/// there.
Vertices parseMarkerRow(const TextScanner& scanner, std::span<const std::string_view> fields,
                        const std::vector<std::string>& labels, double metres, bool zero_is_missing);

/// Fails at the scanner's line when a table of `bytes` bytes leaves out more than 2^24 fields at the ends of its rows:
/// short rows under many labels would make gigabytes of a small file. rows: those met so far, the current one included.
void requireFilledRows(const TextScanner& scanner, std::size_t rows, std::size_t labels, std::size_t bytes);

}  // namespace shaped
