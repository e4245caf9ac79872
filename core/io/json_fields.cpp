#include "core/io/json_fields.h"

#include <limits>

#include "core/numerics/error.h"

namespace shaped {

using nlohmann::json;

json parseJson(const std::string& file, std::string_view text) {
  constexpr int deepest = 100;
  const auto refuse_depth = [&](int depth, json::parse_event_t, const json&) {
    if (depth > deepest) throw InvalidInput(file, "nests deeper than " + std::to_string(deepest) + " levels");
    return true;
  };
  try {
    return json::parse(text, refuse_depth);
  } catch (const json::exception& problem) {
    throw InvalidInput(file, std::string("is no JSON: ") + problem.what());
  }
}

std::optional<std::int64_t> wholeNumber(const json& object, const char* field, std::int64_t least, std::int64_t most) {
  const auto found = object.find(field);
  if (found == object.end() || !found->is_number_integer()) return std::nullopt;
  constexpr std::uint64_t largest = std::numeric_limits<std::int64_t>::max();
  if (found->is_number_unsigned() && found->get<std::uint64_t>() > largest) return std::nullopt;
  const auto value = found->get<std::int64_t>();
  return value >= least && value <= most ? std::optional(value) : std::nullopt;
}

std::int64_t requireWholeNumber(const json& object, const char* field, std::int64_t least, std::int64_t most) {
  if (const auto value = wholeNumber(object, field, least, most)) return *value;
  throw InvalidInput(field, "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
}

}  // namespace shaped
