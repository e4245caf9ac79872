#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace shaped {

/// Parses JSON of at most 100 levels; copying a document that is deeper would overrun the stack. Throws InvalidInput
/// naming the file.
nlohmann::json parseJson(const std::string& file, std::string_view text);

/// A field of an object that is a whole number in [least, most]; nothing when it is missing or anything else.
std::optional<std::int64_t> wholeNumber(const nlohmann::json& object, const char* field, std::int64_t least,
                                        std::int64_t most);

/// The same for a field that must be there. Throws InvalidInput naming it.
std::int64_t requireWholeNumber(const nlohmann::json& object, const char* field, std::int64_t least, std::int64_t most);

}  // namespace shaped
