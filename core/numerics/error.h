#pragma once

#include <stdexcept>
#include <string>

namespace shaped {

/// Input that no method could work on: the caller must change it. The text names the field or file, the index and the cure.
class InvalidInput : public std::invalid_argument {
 public:
  /// field: what was wrong ("faces[12]", "handles.csv:3"); problem: why, and what would be accepted.
  InvalidInput(std::string field, const std::string& problem)
      : std::invalid_argument(field.empty() ? problem : field + ": " + problem), field_(std::move(field)) {}

  const std::string& field() const { return field_; }

 private:
  std::string field_;
};

}  // namespace shaped
