#include "core/io/mesh_formats.h"
#include "core/io/polygon_soup.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// The keyword line: [ST][C][N]OFF. Normals, colours and texture coordinates follow x, y, z in a vertex's line, in
/// that order. True when there are normals.
bool readKeyword(TextScanner& scanner, const std::string& file) {
  if (!scanner.nextContentLine('#')) throw InvalidInput(file, "holds nothing but blanks and comments");
  auto keyword = scanner.word();
  const auto whole = keyword;
  for (const std::string_view prefix : {"ST", "C", "N"})
    if (keyword.starts_with(prefix)) keyword.remove_prefix(prefix.size());
  if (keyword != "OFF")
    scanner.fail(quotedWord(whole) + " is not the keyword of a three-dimensional OFF file; want OFF");
  return whole.ends_with("NOFF");
}

void nextLineOf(TextScanner& scanner, const char* element, std::int64_t index, std::int64_t count,
                const std::string& file) {
  if (!scanner.nextContentLine('#'))
    throw InvalidInput(file, "is truncated: ends before " + std::string(element) + " " + std::to_string(index) +
                                 " of the " + std::to_string(count) + " its header promises");
}

}  // namespace

void parseOff(const std::string& file, std::string_view text, PolygonSoup& soup) {
  TextScanner scanner(file, text);
  const bool with_normals = readKeyword(scanner, file) && soup.keepsNormals();
  if (scanner.restOfLine().find_first_not_of(" \t") == std::string_view::npos && !scanner.nextContentLine('#'))
    throw InvalidInput(file, "is truncated: ends before its counts");
  if (scanner.restOfLine().find("BINARY") != std::string_view::npos)
    scanner.fail("binary OFF is not supported; save it as text or as PLY");
  const auto vertex_count = scanner.integer("the number of vertices");
  const auto face_count = scanner.integer("the number of faces");
  if (vertex_count < 0 || face_count < 0) scanner.fail("a count is negative");
  for (std::int64_t v = 0; v < vertex_count; ++v) {
    nextLineOf(scanner, "vertex", v, vertex_count, file);
    const double x = scanner.number("x"), y = scanner.number("y"), z = scanner.number("z");
    soup.addVertex(x, y, z);
    if (!with_normals) continue;
    const double nx = scanner.number("nx"), ny = scanner.number("ny"), nz = scanner.number("nz");
    soup.addNormal(nx, ny, nz);
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t f = 0; f < face_count; ++f) {
    nextLineOf(scanner, "face", f, face_count, file);
    corners.clear();
    const auto corner_count = scanner.integer("the number of corners");
    for (std::int64_t c = 0; c < corner_count; ++c) corners.push_back(scanner.integer("a vertex index"));
    soup.addPolygon(corners);
  }
  if (scanner.nextContentLine('#'))
    scanner.fail("the file goes on after the " + std::to_string(vertex_count) + " vertices and " +
                 std::to_string(face_count) + " faces its header promises");
}

std::string formatOff(const Vertices& vertices, const Faces& faces) {
  std::string text = "OFF\n" + std::to_string(vertices.rows()) + " " + std::to_string(faces.rows()) + " 0\n";
  for (const auto& v : vertices.rowwise()) text += shortest(v[0]) + " " + shortest(v[1]) + " " + shortest(v[2]) + "\n";
  for (const auto& f : faces.rowwise())
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + "\n";
  return text;
}

}  // namespace shaped
