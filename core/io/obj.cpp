#include "core/io/mesh_formats.h"
#include "core/io/polygon_soup.h"
#include "core/io/text_scanner.h"

namespace shaped {
namespace {

/// One corner, "v", "v/t", "v//n" or "v/t/n": v counts from 1, or backwards from the newest vertex when negative.
std::int64_t cornerIndex(const TextScanner& scanner, std::string_view word, std::int64_t vertex_count) {
  std::int64_t index = 0;
  if (!parseInteger(word.substr(0, word.find('/')), index) || index == 0)
    scanner.fail(quotedWord(word) + " is no face corner; want v, v/t, v//n or v/t/n with v counted from 1");
  if (index < -vertex_count)
    scanner.fail("corner " + quotedWord(word) + " counts back beyond the first of " + std::to_string(vertex_count) +
                 " vertices");
  return index > 0 ? index - 1 : vertex_count + index;
}

void readCorners(TextScanner& scanner, std::int64_t vertex_count, std::vector<std::int64_t>& corners) {
  corners.clear();
  for (auto word = scanner.word(); !word.empty(); word = scanner.word()) {
    if (word != "\\")
      corners.push_back(cornerIndex(scanner, word, vertex_count));
    else if (!scanner.nextContentLine('#'))  // a backslash goes on in the next line
      scanner.fail("the file ends in the middle of a face");
  }
}

}  // namespace

MeshFile parseObj(const std::string& file, std::string_view text) {
  TextScanner scanner(file, text);
  PolygonSoup soup(file);
  std::vector<std::int64_t> corners;
  while (scanner.nextContentLine('#')) {
    const auto keyword = scanner.word();
    if (keyword == "v") {
      const double x = scanner.number("x"), y = scanner.number("y"), z = scanner.number("z");
      soup.addVertex(x, y, z);
    } else if (keyword == "f") {
      readCorners(scanner, soup.vertexCount(), corners);
      if (corners.size() < 3) scanner.fail("a face has fewer than 3 corners");
      soup.addPolygon(corners);
    }
  }
  return soup.finish();
}

std::string formatObj(const Vertices& vertices, const Faces& faces) {
  std::string text;
  for (const auto& v : vertices.rowwise())
    text += "v " + shortest(v[0]) + " " + shortest(v[1]) + " " + shortest(v[2]) + "\n";
  for (const auto& f : faces.rowwise())
    text += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " + std::to_string(f[2] + 1) + "\n";
  return text;
}

}  // namespace shaped
