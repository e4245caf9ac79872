#pragma once

#include <filesystem>

#include "core/mesh/types.h"

namespace shaped {

/// A triangle mesh as a file holds it: vertices and faces in the file's order, nothing dropped, merged or repaired.
struct MeshFile {
  Vertices vertices;  ///< in the file's unit
  Faces faces;        ///< polygons (a, b, c, d, ...) as the fan (a, b, c), (a, c, d), ...
};

/// Reads OBJ, OFF, PLY (ascii, binary of both byte orders) or STL (ascii, binary), chosen by the extension.
/// Coordinates keep double precision where the file has it. STL corners at exactly the same position become one vertex,
/// numbered by first appearance; the other formats are not welded. Normals, colours and texture coordinates are
/// skipped.
///
/// Throws InvalidInput naming the file (and the line in text formats) when it cannot be opened, is empty or truncated,
/// breaks its format, has bytes or lines left over, has no vertices or no faces, a coordinate that is not finite (with
/// the vertex index), a face of fewer than three corners or a corner that is no vertex. Whether the faces form a
/// surface is for Topology to say: a repeated vertex or a third face at an edge passes here unchanged.
///
/// OpenMesh's readers are not used: they round every coordinate to float (an energy error of 5e-8), drop degenerate
/// faces silently, read past the end of truncated files, and share state between threads. Its reader and writer are the
/// independent witnesses in our tests.
MeshFile readMesh(const std::filesystem::path& path);

/// Writes OBJ, OFF, PLY (binary, little-endian, doubles) or STL (binary, floats), chosen by the extension. All but STL
/// read back exactly. The file appears only when complete.
/// Throws InvalidInput for an unknown extension, no vertices, no faces, a coordinate that is not finite or a face with
/// an index out of range; FileError when writing fails.
void writeMesh(const std::filesystem::path& path, const Vertices& vertices, const Faces& faces);

}  // namespace shaped
