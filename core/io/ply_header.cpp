#include "core/io/ply_header.h"

#include <array>
#include <optional>
#include <utility>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypeNames{{{"char", PlyType::kInt8},
                                                                           {"int8", PlyType::kInt8},
                                                                           {"uchar", PlyType::kUint8},
                                                                           {"uint8", PlyType::kUint8},
                                                                           {"short", PlyType::kInt16},
                                                                           {"int16", PlyType::kInt16},
                                                                           {"ushort", PlyType::kUint16},
                                                                           {"uint16", PlyType::kUint16},
                                                                           {"int", PlyType::kInt32},
                                                                           {"int32", PlyType::kInt32},
                                                                           {"uint", PlyType::kUint32},
                                                                           {"uint32", PlyType::kUint32},
                                                                           {"float", PlyType::kFloat32},
                                                                           {"float32", PlyType::kFloat32},
                                                                           {"double", PlyType::kFloat64},
                                                                           {"float64", PlyType::kFloat64}}};

PlyType readType(TextScanner& scanner) {
  const auto word = scanner.word();
  for (const auto& [name, type] : kTypeNames)
    if (name == word) return type;
  scanner.fail(quotedWord(word) + " is no PLY number type");
}

PlyEncoding readEncoding(TextScanner& scanner) {
  const auto word = scanner.word();
  if (word == "ascii") return PlyEncoding::kAscii;
  if (word == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (word == "binary_big_endian") return PlyEncoding::kBigEndian;
  scanner.fail(quotedWord(word) + " is no PLY format; want ascii, binary_little_endian or binary_big_endian");
}

PlyProperty readProperty(TextScanner& scanner) {
  PlyProperty property;
  TextScanner ahead = scanner;
  property.is_list = ahead.word() == "list";
  if (property.is_list) {
    scanner.word();
    property.count_type = readType(scanner);
    if (property.count_type >= PlyType::kFloat32) scanner.fail("the length of a list must be a whole number");
  }
  property.type = readType(scanner);
  property.name = scanner.word();
  if (property.name.empty()) scanner.fail("a property has no name");
  return property;
}

PlyElement readElement(TextScanner& scanner) {
  PlyElement element{std::string(scanner.word()), 0, {}};
  if (element.name.empty()) scanner.fail("an element has no name");
  element.count = scanner.integer("the number of elements");
  if (element.count < 0) scanner.fail("the number of elements is negative");
  return element;
}

/// The text up to and with the line "end_header", whose line end is one or two bytes.
std::string_view headerText(const std::string& file, std::string_view bytes) {
  constexpr std::string_view last = "end_header";
  if (!bytes.starts_with("ply")) throw InvalidInput(file, "does not begin with 'ply'");
  for (auto at = bytes.find(last); at != std::string_view::npos; at = bytes.find(last, at + 1)) {
    const char before = bytes[at - 1];
    auto end = at + last.size();
    if ((before != '\n' && before != '\r') || end == bytes.size()) continue;
    if (bytes[end] != '\n' && bytes[end] != '\r') continue;
    if (bytes.substr(end, 2) == "\r\n") ++end;
    return bytes.substr(0, end + 1);
  }
  throw InvalidInput(file, "is truncated: its header has no 'end_header' line");
}

}  // namespace

std::size_t sizeOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat32:
      return 4;
    case PlyType::kFloat64:
      return 8;
  }
  return 0;
}

PlyHeader parsePlyHeader(const std::string& file, std::string_view bytes) {
  const auto text = headerText(file, bytes);
  TextScanner scanner(file, text);
  std::optional<PlyEncoding> encoding;
  PlyHeader header{PlyEncoding::kAscii, {}, text.size()};
  scanner.nextLine();  // ply
  while (scanner.nextLine()) {
    const auto keyword = scanner.word();
    if (keyword == "format")
      encoding = readEncoding(scanner);
    else if (keyword == "element")
      header.elements.push_back(readElement(scanner));
    else if (keyword == "property" && !header.elements.empty())
      header.elements.back().properties.push_back(readProperty(scanner));
    else if (keyword == "end_header")
      break;
    else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty())
      scanner.fail(quotedWord(keyword) + " does not belong in a PLY header here");
  }
  if (!encoding) throw InvalidInput(file, "has a PLY header without a 'format' line");
  header.encoding = *encoding;
  return header;
}

}  // namespace shaped
