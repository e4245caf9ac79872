#pragma once

#include <string>
#include <string_view>

#include "core/io/mesh_file.h"

namespace shaped {

// One parser and one formatter a mesh format, each in its own source file; for mesh_file.cpp and no one else.
// file: the name for error texts. Readers throw InvalidInput as readMesh says; formatters take a mesh that was checked.
MeshFile parseObj(const std::string& file, std::string_view text);
MeshFile parseOff(const std::string& file, std::string_view text);
MeshFile parsePly(const std::string& file, std::string_view bytes);
MeshFile parseStl(const std::string& file, std::string_view bytes);

std::string formatObj(const Vertices& vertices, const Faces& faces);
std::string formatOff(const Vertices& vertices, const Faces& faces);
std::string formatPly(const Vertices& vertices, const Faces& faces);
std::string formatStl(const Vertices& vertices, const Faces& faces);

}  // namespace shaped
