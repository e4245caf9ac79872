#include "core/scene/gltf_document.h"

#include "core/io/byte_reader.h"
#include "core/io/json_fields.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {

GltfDocument readGltfDocument(const std::string& file, std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return {parseJson(file, bytes), std::nullopt};
  ByteReader reader(file, bytes);
  reader.take(4);
  if (const auto version = reader.number<std::uint32_t>(std::endian::little); version != 2)
    throw InvalidInput(file, "is glTF of version " + std::to_string(version) + ", want 2");
  if (reader.number<std::uint32_t>(std::endian::little) != bytes.size())
    throw InvalidInput(file, "is truncated or has bytes left over: its header says another length");
  const auto length = reader.number<std::uint32_t>(std::endian::little);
  if (reader.take(4) != "JSON") throw InvalidInput(file, "does not begin with its JSON part");
  GltfDocument result{parseJson(file, reader.take(length)), std::nullopt};
  if (reader.remaining() == 0) return result;
  result.binary = reader.number<std::uint32_t>(std::endian::little);
  if (reader.take(4) != std::string_view("BIN\0", 4)) throw InvalidInput(file, "has a second part that is not BIN");
  reader.take(static_cast<std::size_t>(*result.binary));
  return result;
}

void GltfEntry::fail(const std::string& problem) const {
  throw InvalidInput(file, place.empty() ? problem : place + " " + problem);
}

std::int64_t GltfEntry::whole(const char* field, std::int64_t least, std::int64_t most) const {
  if (const auto value = wholeNumber(fields, field, least, most)) return *value;
  fail(std::string("needs a whole number from ") + std::to_string(least) + " to " + std::to_string(most) + " as " +
       field);
}

std::int64_t GltfEntry::whole(const char* field, std::int64_t least, std::int64_t most, std::int64_t otherwise) const {
  return has(field) ? whole(field, least, most) : otherwise;
}

GltfEntry GltfEntry::object(const char* field) const {
  const auto found = fields.find(field);
  if (found == fields.end() || !found->is_object()) fail(std::string("needs an object as ") + field);
  return {file, *found, place + "." + field};
}

std::vector<GltfEntry> GltfEntry::list(const char* field) const {
  std::vector<GltfEntry> entries;
  const auto found = fields.find(field);
  if (found == fields.end()) return entries;
  const std::string name = (place.empty() ? "" : place + ".") + field;
  if (!found->is_array()) throw InvalidInput(file, name + " is no list");
  for (const auto& value : *found) {
    entries.push_back({file, value, name + "[" + std::to_string(entries.size()) + "]"});
    if (!value.is_object()) entries.back().fail("is no object");
  }
  return entries;
}

std::vector<std::int64_t> GltfEntry::indices(const char* field, std::size_t count) const {
  std::vector<std::int64_t> result;
  const auto found = fields.find(field);
  if (found == fields.end()) return result;
  if (!found->is_array()) fail(std::string("needs a list as ") + field);
  for (const auto& value : *found) {
    if (!value.is_number_integer() || value < 0 || value >= count)
      fail(std::string("names ") + field + " " + quotedWord(value.dump()) + ", outside [0, " + std::to_string(count) +
           ")");
    result.push_back(value.get<std::int64_t>());
  }
  return result;
}

}  // namespace shaped
