#pragma once

#include <cmath>
#include <optional>
#include <string>

namespace shaped {

/// For an options struct's firstViolation(): "FIELD = -1.0, want > 0" unless the value is positive and finite.
inline std::optional<std::string> unlessPositive(const std::string& field, double value) {
  if (value > 0 && std::isfinite(value)) return std::nullopt;
  return field + " = " + std::to_string(value) + ", want > 0";
}

}  // namespace shaped
