#include <array>
#include <vector>

#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

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

/// Normals of a file, and which of them is each vertex's: OBJ gives them to corners of faces.
class CornerNormals {
 public:
  void add(double x, double y, double z) { normals_.push_back({x, y, z}); }

  /// The n of a corner "v//n" or "v/t/n", if it has one.
  void addCorner(const TextScanner& scanner, std::string_view word, std::int64_t vertex) {
    const auto first = word.find('/'), last = word.rfind('/');
    if (first == last || last + 1 == word.size()) return;
    std::int64_t index = 0;
    const auto count = static_cast<std::int64_t>(normals_.size());
    if (!parseInteger(word.substr(last + 1), index) || index == 0 || index < -count)
      scanner.fail(quotedWord(word) + " names none of the file's normals, counted from 1");
    corners_.push_back({vertex, index > 0 ? index - 1 : count + index});
    in_order_ = in_order_ && corners_.back().vertex == corners_.back().normal;
  }

  /// One normal for every vertex, or none at all where some vertex has none or two.
  void giveTo(PolygonSoup& soup, const std::string& file) const {
    for (const auto& corner : corners_)
      if (corner.normal >= static_cast<std::int64_t>(normals_.size()))
        throw InvalidInput(file, "a face has normal " + std::to_string(corner.normal + 1) + " of the file's " +
                                     std::to_string(normals_.size()));
    for (const auto& [x, y, z] : ofVertices(static_cast<std::size_t>(soup.vertexCount()))) soup.addNormal(x, y, z);
  }

 private:
  using Normal = std::array<double, 3>;
  struct Corner {
    std::int64_t vertex, normal;
  };

  /// Empty where they are not clear. Points without faces, and most scanners' meshes, list normals as they list points.
  std::vector<Normal> ofVertices(std::size_t vertex_count) const {
    if (in_order_ && normals_.size() == vertex_count) return normals_;
    std::vector<const Normal*> found(vertex_count, nullptr);
    for (const auto& corner : corners_) {
      if (corner.vertex >= static_cast<std::int64_t>(vertex_count)) return {};  // for the soup to refuse
      auto& known = found[static_cast<std::size_t>(corner.vertex)];
      const Normal* normal = &normals_[static_cast<std::size_t>(corner.normal)];
      if (known != nullptr && *known != *normal) return {};
      known = normal;
    }
    std::vector<Normal> result;
    for (const auto* normal : found) {
      if (normal == nullptr) return {};
      result.push_back(*normal);
    }
    return result;
  }

  std::vector<Normal> normals_;
  std::vector<Corner> corners_;
  bool in_order_ = true;
};

/// The vertices of a face's corners; where `normals` is given, it learns theirs.
void readCorners(TextScanner& scanner, std::int64_t vertex_count, std::vector<std::int64_t>& corners,
                 CornerNormals* normals) {
  corners.clear();
  for (auto word = scanner.word(); !word.empty(); word = scanner.word()) {
    if (word != "\\") {
      corners.push_back(cornerIndex(scanner, word, vertex_count));
      if (normals != nullptr) normals->addCorner(scanner, word, corners.back());
    } else if (!scanner.nextContentLine('#')) {  // a backslash goes on in the next line
      scanner.fail("the file ends in the middle of a face");
    }
  }
}

}  // namespace

void parseObj(const std::string& file, std::string_view text, PolygonSoup& soup) {
  TextScanner scanner(file, text);
  CornerNormals normals;
  std::vector<std::int64_t> corners;
  while (scanner.nextContentLine('#')) {
    const auto keyword = scanner.word();
    if (keyword == "v") {
      const double x = scanner.number("x"), y = scanner.number("y"), z = scanner.number("z");
      soup.addVertex(x, y, z);
    } else if (keyword == "vn" && soup.keepsNormals()) {
      const double x = scanner.number("nx"), y = scanner.number("ny"), z = scanner.number("nz");
      normals.add(x, y, z);
    } else if (keyword == "f") {
      readCorners(scanner, soup.vertexCount(), corners, soup.keepsNormals() ? &normals : nullptr);
      if (corners.size() < 3) scanner.fail("a face has fewer than 3 corners");
      soup.addPolygon(corners);
    }
  }
  normals.giveTo(soup, file);
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
