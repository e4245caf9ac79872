#pragma once

#include "core/mesh/types.h"

namespace shaped {

/// A raw scan: points of a surface, with their normals where the scanner knows them, or a mesh, which may have holes,
/// several pieces and edges of more than two triangles.
struct Scan {
  Vertices points;   ///< N x 3, m
  Vertices normals;  ///< N x 3 outward unit normals, or empty
  Faces faces;       ///< F x 3, or empty for points alone
};

}  // namespace shaped
