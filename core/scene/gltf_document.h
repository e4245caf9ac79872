#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shaped {

/// The two parts of a glTF file: its document, and how many bytes follow as the first buffer.
struct GltfDocument {
  nlohmann::json json;
  std::optional<std::int64_t> binary;  ///< nothing in a .gltf and where nothing follows
};

/// Takes a .glb or .gltf file apart. Throws InvalidInput naming the file when it is truncated, of another version, has
/// bytes left over or is no JSON.
GltfDocument readGltfDocument(const std::string& file, std::string_view bytes);

/// One entry of the document, with its place for error texts. All that is asked of it and is not there or not of its
/// kind throws InvalidInput naming file and place.
struct GltfEntry {
  const std::string& file;
  const nlohmann::json& fields;
  std::string place;

  [[noreturn]] void fail(const std::string& problem) const;
  bool has(const char* field) const { return fields.contains(field); }

  /// A whole number in [least, most].
  std::int64_t whole(const char* field, std::int64_t least, std::int64_t most) const;
  /// The same, or `otherwise` where there is none.
  std::int64_t whole(const char* field, std::int64_t least, std::int64_t most, std::int64_t otherwise) const;
  GltfEntry object(const char* field) const;
  /// The list of that name, each of its entries an object; empty when there is none.
  std::vector<GltfEntry> list(const char* field) const;
  /// The whole numbers in [0, count) of the list of that name; empty when there is none.
  std::vector<std::int64_t> indices(const char* field, std::size_t count) const;
};

}  // namespace shaped
