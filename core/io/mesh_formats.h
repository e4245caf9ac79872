#pragma once

#include <string>
#include <string_view>

#include "core/io/polygon_soup.h"

namespace shaped {

// One parser and one formatter a format, each in its own source file; for mesh_file.cpp and scan_file.cpp and no one
// else. file: the name for error texts. Parsers hand what they meet to the soup, normals only where it keeps them, and
// throw InvalidInput as readMesh and readScan say; formatters take what was checked.
void parseObj(const std::string& file, std::string_view text, PolygonSoup& soup);
void parseOff(const std::string& file, std::string_view text, PolygonSoup& soup);
void parsePly(const std::string& file, std::string_view bytes, PolygonSoup& soup);
void parseStl(const std::string& file, std::string_view bytes, PolygonSoup& soup);
/// Points alone: rows of x y z or x y z nx ny nz.
void parseNpyPoints(const std::string& file, std::string_view bytes, PolygonSoup& soup);
void parseXyz(const std::string& file, std::string_view text, PolygonSoup& soup);

std::string formatObj(const Vertices& vertices, const Faces& faces);
std::string formatOff(const Vertices& vertices, const Faces& faces);
std::string formatPly(const Vertices& vertices, const Faces& faces);
std::string formatStl(const Vertices& vertices, const Faces& faces);
/// A PLY of a scan; normals and faces may be empty.
std::string formatPlyScan(const Vertices& points, const Vertices& normals, const Faces& faces);

/// Throws InvalidInput naming the file and the vertex or face when a coordinate is not finite or a corner no vertex.
void requireSound(const std::string& file, const Vertices& vertices, const Faces& faces);

}  // namespace shaped
