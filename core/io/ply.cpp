#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/io/byte_reader.h"
#include "core/io/mesh_formats.h"
#include "core/io/ply_header.h"
#include "core/io/polygon_soup.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Numbers of the body one after the other, whatever the line they stand in.
class AsciiBody {
 public:
  AsciiBody(std::string file, std::string_view text) : scanner_(file, text), file_(std::move(file)) {}

  double number(PlyType) {
    const auto word = nextWord();
    double value = 0;
    if (word.empty()) throw InvalidInput(file_, "is truncated: ends before the data its header promises");
    if (!parseNumber(word, value)) throw InvalidInput(file_, quotedWord(word) + " stands where a number should");
    return value;
  }

  void requireEnd() {
    if (const auto word = nextWord(); !word.empty())
      throw InvalidInput(file_, "goes on with " + quotedWord(word) + " after the data its header promises");
  }

 private:
  std::string_view nextWord() {
    auto word = scanner_.word();
    while (word.empty() && scanner_.nextLine()) word = scanner_.word();
    return word;
  }

  TextScanner scanner_;
  std::string file_;
};

class BinaryBody {
 public:
  BinaryBody(std::string file, std::string_view bytes, std::endian order)
      : bytes_(file, bytes), order_(order), file_(std::move(file)) {}

  double number(PlyType type) {
    switch (type) {
      case PlyType::kInt8:
        return bytes_.number<std::int8_t>(order_);
      case PlyType::kUint8:
        return bytes_.number<std::uint8_t>(order_);
      case PlyType::kInt16:
        return bytes_.number<std::int16_t>(order_);
      case PlyType::kUint16:
        return bytes_.number<std::uint16_t>(order_);
      case PlyType::kInt32:
        return bytes_.number<std::int32_t>(order_);
      case PlyType::kUint32:
        return bytes_.number<std::uint32_t>(order_);
      case PlyType::kFloat32:
        return bytes_.number<float>(order_);
      case PlyType::kFloat64:
        return bytes_.number<double>(order_);
    }
    return 0;
  }

  void requireEnd() {
    if (bytes_.remaining() > 0)
      throw InvalidInput(
          file_, "goes on for " + std::to_string(bytes_.remaining()) + " bytes after the data its header promises");
  }

 private:
  ByteReader bytes_;
  std::endian order_;
  std::string file_;
};

/// A number that counts or names vertices: every such number is exact in a double.
std::int64_t wholeNumber(const std::string& file, double value, const char* what) {
  if (!(std::abs(value) < 4294967296.0) || value != std::floor(value))
    throw InvalidInput(file, shortest(value) + " stands where " + what + " should");
  return static_cast<std::int64_t>(value);
}

template <class Body>
void readList(const std::string& file, Body& body, const PlyProperty& property, std::vector<double>& values) {
  const auto count = wholeNumber(file, body.number(property.count_type), "the length of a list");
  if (count < 0) throw InvalidInput(file, "a list has the length " + std::to_string(count));
  values.clear();
  for (std::int64_t i = 0; i < count; ++i) values.push_back(body.number(property.type));
}

/// Where three numbers of a vertex stand among its properties.
using Places = std::array<std::size_t, 3>;

std::size_t placeOf(const PlyElement& element, std::string_view name) {
  const auto& properties = element.properties;
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const PlyProperty& p) { return p.name == name && !p.is_list; });
  return static_cast<std::size_t>(found - properties.begin());
}

Places placesOf(const std::string& file, const PlyElement& element, const std::array<std::string_view, 3>& names) {
  Places places;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    places[axis] = placeOf(element, names[axis]);
    if (places[axis] == element.properties.size())
      throw InvalidInput(file, "has vertices without the property " + std::string(names[axis]));
  }
  return places;
}

/// Nothing when no normal is wanted or none is there; half a normal is refused.
std::optional<Places> normalPlaces(const std::string& file, const PlyElement& element, const PolygonSoup& soup) {
  constexpr std::array<std::string_view, 3> names{"nx", "ny", "nz"};
  const auto has = [&](std::string_view name) { return placeOf(element, name) < element.properties.size(); };
  if (!soup.keepsNormals() || std::none_of(names.begin(), names.end(), has)) return std::nullopt;
  return placesOf(file, element, names);
}

template <class Body>
void readVertices(const std::string& file, Body& body, const PlyElement& element, PolygonSoup& soup) {
  const auto places = placesOf(file, element, {"x", "y", "z"});
  const auto normal = normalPlaces(file, element, soup);
  std::vector<double> values(element.properties.size()), list;
  for (std::int64_t i = 0; i < element.count; ++i) {
    for (std::size_t p = 0; p < values.size(); ++p) {
      const auto& property = element.properties[p];
      if (property.is_list)
        readList(file, body, property, list);
      else
        values[p] = body.number(property.type);
    }
    soup.addVertex(values[places[0]], values[places[1]], values[places[2]]);
    if (normal) soup.addNormal(values[(*normal)[0]], values[(*normal)[1]], values[(*normal)[2]]);
  }
}

/// Faces go to the soup; any other element is only walked over.
template <class Body>
void readOther(const std::string& file, Body& body, const PlyElement& element, PolygonSoup& soup) {
  if (element.properties.empty()) return;  // no data, whatever the count
  std::vector<double> list;
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < element.count; ++i) {
    for (const auto& property : element.properties) {
      if (!property.is_list) {
        body.number(property.type);
        continue;
      }
      readList(file, body, property, list);
      if (element.name != "face" || (property.name != "vertex_indices" && property.name != "vertex_index")) continue;
      corners.clear();
      for (const double value : list) corners.push_back(wholeNumber(file, value, "a vertex index"));
      soup.addPolygon(corners);
    }
  }
}

template <class Body>
void readBody(const std::string& file, Body body, const PlyHeader& header, PolygonSoup& soup) {
  for (const auto& element : header.elements) {
    if (element.name == "vertex")
      readVertices(file, body, element, soup);
    else
      readOther(file, body, element, soup);
  }
  body.requireEnd();
}

}  // namespace

void parsePly(const std::string& file, std::string_view bytes, PolygonSoup& soup) {
  const auto header = parsePlyHeader(file, bytes);
  const auto data = bytes.substr(header.size);
  if (header.encoding == PlyEncoding::kAscii) return readBody(file, AsciiBody(file, data), header, soup);
  const auto order = header.encoding == PlyEncoding::kLittleEndian ? std::endian::little : std::endian::big;
  return readBody(file, BinaryBody(file, data, order), header, soup);
}

std::string formatPly(const Vertices& vertices, const Faces& faces) { return formatPlyScan(vertices, {}, faces); }

std::string formatPlyScan(const Vertices& points, const Vertices& normals, const Faces& faces) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.rows()) + "\n";
  for (const char* name : {"x", "y", "z"}) bytes += "property double " + std::string(name) + "\n";
  if (normals.rows() > 0)
    for (const char* name : {"nx", "ny", "nz"}) bytes += "property double " + std::string(name) + "\n";
  if (faces.rows() > 0)
    bytes += "element face " + std::to_string(faces.rows()) + "\nproperty list uchar int vertex_indices\n";
  bytes += "end_header\n";
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    for (const double x : points.row(v)) appendNumber(bytes, x, std::endian::little);
    if (normals.rows() == 0) continue;
    for (const double x : normals.row(v)) appendNumber(bytes, x, std::endian::little);
  }
  for (const auto& f : faces.rowwise()) {
    appendNumber(bytes, std::uint8_t{3}, std::endian::little);
    for (const std::int32_t corner : f) appendNumber(bytes, corner, std::endian::little);
  }
  return bytes;
}

}  // namespace shaped
