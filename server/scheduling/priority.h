#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace shaped::server {

/// How urgent a request is, as its client says; the most urgent first.
enum class Priority {
  kInteractive,  ///< somebody waits at a screen
  kNormal,
  kBatch,  ///< may take its time
};

inline constexpr std::array kPriorities{Priority::kInteractive, Priority::kNormal, Priority::kBatch};

constexpr std::string_view name(Priority priority) {
  constexpr std::array<std::string_view, kPriorities.size()> names{"interactive", "normal", "batch"};
  return names.at(static_cast<std::size_t>(priority));
}

/// Nothing for another name.
constexpr std::optional<Priority> priorityNamed(std::string_view wanted) {
  for (const auto priority : kPriorities)
    if (name(priority) == wanted) return priority;
  return std::nullopt;
}

}  // namespace shaped::server
