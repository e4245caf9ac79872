#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "core/numerics/error.h"

namespace shaped::shapectl {

/// An option's whole number for the wire; 0 leaves the choice to the daemon. Throws InvalidInput naming the option when
/// it is negative or too large.
inline std::uint32_t countOf(const std::string& option, std::int64_t value) {
  if (value < 0 || value > std::numeric_limits<std::int32_t>::max())
    throw InvalidInput(option, "= " + std::to_string(value) + ", want a whole number of 1 or more");
  return static_cast<std::uint32_t>(value);
}

}  // namespace shaped::shapectl
