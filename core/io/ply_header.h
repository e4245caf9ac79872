#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace shaped {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

/// Bytes of one number of the type.
std::size_t sizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  ///< of a list's length
};

struct PlyElement {
  std::string name;
  std::int64_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding;
  std::vector<PlyElement> elements;  ///< in the order of their data
  std::size_t size;                  ///< bytes up to the first datum
};

/// Parses "ply ... end_header". Throws InvalidInput naming the file and the line.
PlyHeader parsePlyHeader(const std::string& file, std::string_view bytes);

}  // namespace shaped
