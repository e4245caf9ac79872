#include "core/io/scan_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/io/file.h"
#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

struct Format {
  std::string_view extension;
  void (*parse)(const std::string& file, std::string_view bytes, PolygonSoup& soup);
};

constexpr std::array kFormats{Format{".ply", parsePly}, Format{".obj", parseObj},       Format{".off", parseOff},
                              Format{".stl", parseStl}, Format{".npy", parseNpyPoints}, Format{".xyz", parseXyz}};

void requireNormals(const std::string& file, const Scan& scan) {
  if (scan.normals.rows() == 0) return;
  if (scan.normals.rows() != scan.points.rows())
    throw InvalidInput(file, std::to_string(scan.normals.rows()) + " normals for " +
                                 std::to_string(scan.points.rows()) + " points; want one for each, or none");
  for (Eigen::Index i = 0; i < scan.normals.rows(); ++i) {
    const double length = scan.normals.row(i).norm();
    if (!(std::abs(length - 1) <= 1e-3))
      throw InvalidInput(file,
                         "the normal of point " + std::to_string(i) + " has length " + shortest(length) + "; want 1");
  }
}

}  // namespace

Scan readScan(const std::filesystem::path& path) {
  const auto extension = extensionOf(path);
  const auto* format =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& known) { return known.extension == extension; });
  if (format == kFormats.end())
    throw InvalidInput(path.string(),
                       "is no scan by its extension '" + extension + "'; want .ply, .obj, .off, .stl, .npy or .xyz");
  PolygonSoup soup(path.string(), FileNormals::kKept);
  format->parse(path.string(), readFile(path), soup);
  return soup.finishScan();
}

void writeScan(const std::filesystem::path& path, const Scan& scan) {
  const auto file = path.string();
  if (extensionOf(path) != ".ply") throw InvalidInput(file, "a scan is written as PLY; want the extension .ply");
  if (scan.points.rows() == 0) throw InvalidInput(file, "no points to write");
  requireSound(file, scan.points, scan.faces);
  requireNormals(file, scan);
  writeFile(path, formatPlyScan(scan.points, scan.normals, scan.faces));
}

}  // namespace shaped
