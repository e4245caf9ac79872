#pragma once

#include "core/mesh/types.h"

namespace shaped {

/// Throws InvalidInput, naming `vertices` or the face, when there is no face, a coordinate is not finite or an index is
/// out of range. Triangles without area and vertices in no triangle pass.
void requireTriangles(const Vertices& vertices, const Faces& faces);

}  // namespace shaped
