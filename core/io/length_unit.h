#pragma once

#include <optional>
#include <string_view>

namespace shaped {

/// Metres in one unit of length by its name in a file ("mm", "Meters", "in"); nothing for a name we do not know.
std::optional<double> metresPer(std::string_view unit);

}  // namespace shaped
