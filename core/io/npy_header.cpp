#include "core/io/npy_header.h"

#include <array>
#include <numeric>
#include <optional>

#include "core/io/byte_reader.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);

struct TypeCode {
  std::string_view code;  ///< without the byte order
  NpyType type;
};

constexpr std::array kTypeCodes{TypeCode{"i1", NpyType::kInt8},    TypeCode{"u1", NpyType::kUint8},
                                TypeCode{"i2", NpyType::kInt16},   TypeCode{"u2", NpyType::kUint16},
                                TypeCode{"i4", NpyType::kInt32},   TypeCode{"u4", NpyType::kUint32},
                                TypeCode{"i8", NpyType::kInt64},   TypeCode{"f4", NpyType::kFloat32},
                                TypeCode{"f8", NpyType::kFloat64}, TypeCode{"b1", NpyType::kUint8}};

/// Reads the literal of a Python dictionary with the three keys of the format: strings, booleans and tuples of
/// integers.
class Dictionary {
 public:
  Dictionary(const std::string& file, std::string_view text) : file_(file), text_(text) {}

  void parseInto(NpyHeader& header) {
    expect('{');
    while (!accept('}')) {
      const auto key = string();
      expect(':');
      if (key == "descr")
        parseType(header), has_type_ = true;
      else if (key == "fortran_order")
        parseOrder(), has_order_ = true;
      else if (key == "shape")
        parseShape(header), has_shape_ = true;
      else
        fail("has the unknown key " + quotedWord(key) + " in its header");
      if (!accept(',') && peek() != '}') fail("has a header that is no dictionary");
    }
    if (peek() != '\0') fail("has text after the dictionary in its header");
    if (!has_type_ || !has_order_ || !has_shape_) fail("lacks descr, fortran_order or shape in its header");
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw InvalidInput(file_, problem); }

  char peek() {
    const auto next = text_.find_first_not_of(" \t\n\r");
    text_.remove_prefix(std::min(next, text_.size()));
    return text_.empty() ? '\0' : text_.front();
  }
  bool accept(char c) {
    if (peek() != c || text_.empty()) return false;
    text_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!accept(c)) fail(std::string("has a header without '") + c + "' where it should stand");
  }
  std::string_view string() {
    const char quote = peek();
    if (quote != '\'' && quote != '"') fail("has a header without a string where one should stand");
    const auto end = text_.find(quote, 1);
    if (end == std::string_view::npos) fail("has a header with an open string");
    const auto inside = text_.substr(1, end - 1);
    text_.remove_prefix(end + 1);
    return inside;
  }

  void parseType(NpyHeader& header) {
    if (peek() == '[') fail("holds records; want plain numbers");
    const auto name = string();
    const char order = name.empty() ? '\0' : name.front();
    header.order = order == '>' ? std::endian::big : std::endian::little;
    for (const auto& [code, type] : kTypeCodes) {
      if (name.empty() || name.substr(1) != code || std::string_view("<>|=").find(order) == std::string_view::npos)
        continue;
      header.type = type;
      return;
    }
    fail("holds numbers of type " + quotedWord(name) +
         "; want integers or floats of at most 8 bytes (f4, f8, i4, ...)");
  }

  void parseOrder() {
    if (text_.find("True") == std::min(text_.find_first_not_of(" \t"), text_.size()))
      fail("is stored column by column; save numpy.ascontiguousarray(array) instead");
    peek();
    if (!text_.starts_with("False")) fail("has a header whose fortran_order is neither True nor False");
    text_.remove_prefix(5);
  }

  void parseShape(NpyHeader& header) {
    expect('(');
    while (!accept(')')) {
      peek();
      const auto end = text_.find_first_not_of("0123456789");
      std::int64_t extent = 0;
      if (!parseInteger(text_.substr(0, end), extent)) fail("has a shape that is no tuple of whole numbers");
      text_.remove_prefix(std::min(end, text_.size()));
      header.shape.push_back(extent);
      if (!accept(',') && peek() != ')') fail("has a shape that is no tuple of whole numbers");
    }
  }

  const std::string& file_;
  std::string_view text_;
  bool has_type_ = false, has_order_ = false, has_shape_ = false;
};

/// Bytes of the numbers, or nothing when they do not fit in 63 bits.
std::optional<std::int64_t> dataBytes(const NpyHeader& header) {
  std::int64_t bytes = static_cast<std::int64_t>(sizeOf(header.type));
  bool overflow = false;
  for (const auto extent : header.shape) {
    if (extent == 0) return 0;
    overflow = overflow || __builtin_mul_overflow(bytes, extent, &bytes);
  }
  return overflow ? std::nullopt : std::optional(bytes);
}

/// The shape as a Python tuple, which needs a comma when it holds one number.
std::string tuple(const std::vector<std::int64_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (i > 0) text += ", ";
    text += std::to_string(shape[i]);
  }
  return text += shape.size() == 1 ? ",)" : ")";
}

}  // namespace

std::size_t sizeOf(NpyType type) {
  switch (type) {
    case NpyType::kInt8:
    case NpyType::kUint8:
      return 1;
    case NpyType::kInt16:
    case NpyType::kUint16:
      return 2;
    case NpyType::kInt32:
    case NpyType::kUint32:
    case NpyType::kFloat32:
      return 4;
    case NpyType::kInt64:
    case NpyType::kFloat64:
      return 8;
  }
  return 0;
}

std::int64_t NpyHeader::valueCount() const {
  std::int64_t count = 1;
  for (const auto extent : shape)
    if (extent == 0) return 0;
  for (const auto extent : shape) count *= extent;
  return count;
}

NpyHeader parseNpyHeader(const std::string& file, std::string_view bytes, std::uint64_t file_size) {
  if (!bytes.starts_with(kMagic)) throw InvalidInput(file, "is no .npy file: does not begin with \\x93NUMPY");
  ByteReader reader(file, bytes);
  reader.take(kMagic.size());
  const auto version = reader.number<std::uint8_t>(std::endian::little);
  reader.take(1);
  if (version < 1 || version > 3)
    throw InvalidInput(file, "has .npy format version " + std::to_string(version) + "; want 1, 2 or 3");
  const std::size_t length = version == 1 ? reader.number<std::uint16_t>(std::endian::little)
                                          : reader.number<std::uint32_t>(std::endian::little);
  if (length > kMostNpyHeaderBytes) throw InvalidInput(file, "has a header of " + std::to_string(length) + " bytes");
  NpyHeader header;
  Dictionary(file, reader.take(length)).parseInto(header);
  header.size = reader.position();
  const auto data = dataBytes(header);
  if (!data || file_size - header.size != static_cast<std::uint64_t>(*data))
    throw InvalidInput(file, "has " + std::to_string(file_size - header.size) + " bytes of numbers, but its shape " +
                                 tuple(header.shape) + " of " + std::to_string(sizeOf(header.type)) +
                                 "-byte numbers needs " + (data ? std::to_string(*data) : "more than 2^63"));
  return header;
}

std::string formatNpyHeader(NpyType type, const std::vector<std::int64_t>& shape, std::size_t size) {
  std::string_view code;
  for (const auto& known : kTypeCodes)
    if (known.type == type && code.empty()) code = known.code;
  const std::string order = sizeOf(type) == 1 ? "|" : "<";
  std::string text = "{'descr': '" + order + std::string(code) + "', 'fortran_order': False, 'shape': ";
  text += tuple(shape);
  text += ", }";
  const std::size_t fixed = kMagic.size() + 4;
  if (size == 0) size = (fixed + text.size() + 1 + 63) / 64 * 64;
  if (fixed + text.size() + 1 > size)
    throw InvalidInput("shape", "does not fit in a header of " + std::to_string(size));
  text.resize(size - fixed - 1, ' ');
  text += '\n';
  std::string header(kMagic);
  header += std::string_view("\1\0", 2);
  appendNumber(header, static_cast<std::uint16_t>(text.size()), std::endian::little);
  return header + text;
}

}  // namespace shaped
