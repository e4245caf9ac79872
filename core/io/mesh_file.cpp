#include "core/io/mesh_file.h"

#include <algorithm>
#include <array>

#include "core/io/file.h"
#include "core/io/mesh_formats.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

struct Format {
  std::string_view extension;
  void (*parse)(const std::string& file, std::string_view bytes, PolygonSoup& soup);
  std::string (*format)(const Vertices& vertices, const Faces& faces);
};

constexpr std::array kFormats{Format{".obj", parseObj, formatObj}, Format{".off", parseOff, formatOff},
                              Format{".ply", parsePly, formatPly}, Format{".stl", parseStl, formatStl}};

const Format& formatOf(const std::filesystem::path& path) {
  const auto extension = extensionOf(path);
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(),
                                   [&](const Format& format) { return format.extension == extension; });
  if (found == kFormats.end())
    throw InvalidInput(path.string(), "is no mesh by its extension '" + extension + "'; want .obj, .off, .ply or .stl");
  return *found;
}

void requireWritable(const std::string& file, const Vertices& vertices, const Faces& faces) {
  if (vertices.rows() == 0) throw InvalidInput(file, "no vertices to write");
  if (faces.rows() == 0) throw InvalidInput(file, "no faces to write");
  requireSound(file, vertices, faces);
}

}  // namespace

void requireSound(const std::string& file, const Vertices& vertices, const Faces& faces) {
  for (Eigen::Index v = 0; v < vertices.rows(); ++v)
    if (!vertices.row(v).allFinite())
      throw InvalidInput(file, "vertex " + std::to_string(v) + " has a coordinate that is not a finite number");
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    if (faces.row(f).minCoeff() < 0 || faces.row(f).maxCoeff() >= vertices.rows())
      throw InvalidInput(file, "face " + std::to_string(f) + " has a vertex index outside [0, " +
                                   std::to_string(vertices.rows()) + ")");
}

MeshFile readMesh(const std::filesystem::path& path) {
  const auto& format = formatOf(path);
  PolygonSoup soup(path.string());
  format.parse(path.string(), readFile(path), soup);
  return soup.finishMesh();
}

void writeMesh(const std::filesystem::path& path, const Vertices& vertices, const Faces& faces) {
  const auto& format = formatOf(path);
  requireWritable(path.string(), vertices, faces);
  writeFile(path, format.format(vertices, faces));
}

}  // namespace shaped
