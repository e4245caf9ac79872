#include <Eigen/Geometry>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "core/io/byte_reader.h"
#include "core/io/mesh_formats.h"
#include "core/io/polygon_soup.h"
#include "core/io/text_scanner.h"

namespace shaped {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50;

/// Receives loose triangles and gives equal positions one number. -0 equals 0, as in every comparison of numbers.
class Welder {
 public:
  explicit Welder(PolygonSoup& soup) : soup_(soup) {}

  void addFacet(const std::array<std::array<double, 3>, 3>& corners) {
    std::array<std::int64_t, 3> indices;
    for (std::size_t c = 0; c < 3; ++c) {
      // A position that is not finite is refused by the soup before the map could be confused by it.
      const auto& p = corners[c];
      const bool finite = std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
      const auto known = finite ? numbers_.find(p) : numbers_.end();
      indices[c] = known != numbers_.end() ? known->second : soup_.vertexCount();
      if (known != numbers_.end()) continue;
      soup_.addVertex(p[0], p[1], p[2]);
      numbers_.emplace(p, indices[c]);
    }
    soup_.addPolygon(indices);
  }

 private:
  PolygonSoup& soup_;
  std::map<std::array<double, 3>, std::int64_t> numbers_;
};

void parseBinary(std::string_view bytes, PolygonSoup& soup) {
  Welder welder(soup);
  for (bytes.remove_prefix(kHeaderBytes); !bytes.empty(); bytes.remove_prefix(kFacetBytes)) {
    std::array<std::array<double, 3>, 3> corners;
    for (std::size_t i = 0; i < 9; ++i)  // after the normal's twelve bytes
      corners[i / 3][i % 3] = loadNumber<float>(bytes.data() + 12 + 4 * i, std::endian::little);
    welder.addFacet(corners);
  }
}

std::string lowerCase(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

/// The keywords that must stand next, over line ends.
void expect(TextScanner& scanner, const std::string& file, std::initializer_list<std::string_view> keywords) {
  for (const auto keyword : keywords) {
    auto word = scanner.word();
    while (word.empty()) {
      if (!scanner.nextLine())
        throw InvalidInput(file, "is truncated: ends where '" + std::string(keyword) + "' should stand");
      word = scanner.word();
    }
    if (lowerCase(word) != keyword)
      scanner.fail(quotedWord(word) + " stands where '" + std::string(keyword) + "' should");
  }
}

void readFacet(TextScanner& scanner, const std::string& file, Welder& welder) {
  expect(scanner, file, {"normal"});
  for (int i = 0; i < 3; ++i) scanner.number("the normal");
  expect(scanner, file, {"outer", "loop"});
  std::array<std::array<double, 3>, 3> corners;
  for (auto& corner : corners) {
    expect(scanner, file, {"vertex"});
    for (auto& coordinate : corner) coordinate = scanner.number("a coordinate");
  }
  expect(scanner, file, {"endloop", "endfacet"});
  welder.addFacet(corners);
}

/// One or more solids; the rest of the lines of "solid" and "endsolid" is their name.
void parseText(const std::string& file, std::string_view text, PolygonSoup& soup) {
  TextScanner scanner(file, text);
  Welder welder(soup);
  bool inside = false;
  while (scanner.nextLine()) {
    const auto word = scanner.word();
    if (word.empty()) continue;
    const auto keyword = lowerCase(word);
    if (keyword == "facet" && inside)
      readFacet(scanner, file, welder);
    else if (keyword == (inside ? "endsolid" : "solid"))
      inside = !inside;
    else
      scanner.fail(quotedWord(word) + " stands where '" + (inside ? "facet' or 'endsolid" : "solid") + "' should");
  }
  if (inside) throw InvalidInput(file, "is truncated: ends without 'endsolid'");
}

}  // namespace

void parseStl(const std::string& file, std::string_view bytes, PolygonSoup& soup) {
  // Binary files may begin with "solid" too, so the length decides.
  if (bytes.size() >= kHeaderBytes) {
    const auto count = loadNumber<std::uint32_t>(bytes.data() + 80, std::endian::little);
    const auto size = kHeaderBytes + kFacetBytes * std::uint64_t{count};
    if (bytes.size() == size) return parseBinary(bytes, soup);
    if (!bytes.starts_with("solid"))
      throw InvalidInput(file, "is " + std::to_string(bytes.size()) + " bytes long, but a binary STL of " +
                                   std::to_string(count) + " facets has " + std::to_string(size));
  }
  return parseText(file, bytes, soup);
}

std::string formatStl(const Vertices& vertices, const Faces& faces) {
  if (vertices.cwiseAbs().maxCoeff() > std::numeric_limits<float>::max())
    throw InvalidInput("vertices", "a coordinate is too large for the floats of an STL file");
  std::string bytes(80, ' ');
  const auto append = [&](const Eigen::RowVector3d& v) {
    for (const double x : v) appendNumber(bytes, static_cast<float>(x), std::endian::little);
  };
  appendNumber(bytes, static_cast<std::uint32_t>(faces.rows()), std::endian::little);
  for (const auto& f : faces.rowwise()) {
    const Eigen::RowVector3d a = vertices.row(f[0]), b = vertices.row(f[1]), c = vertices.row(f[2]);
    const Eigen::RowVector3d normal = (b - a).cross(c - a);
    append(normal.norm() > 0 ? Eigen::RowVector3d(normal.normalized()) : normal);
    for (const auto& corner : {a, b, c}) append(corner);
    appendNumber(bytes, std::uint16_t{0}, std::endian::little);
  }
  return bytes;
}

}  // namespace shaped
