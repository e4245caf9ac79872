#pragma once

#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// Points on a surface with their normals.
struct SurfaceSamples {
  Vertices points;   ///< n x 3
  Vertices normals;  ///< n x 3, unit or zero
};

/// `count` points spread over a mesh evenly by area, the same whatever the mesh's placement. At least one triangle must
/// have area (InvalidInput).
SurfaceSamples sampleByArea(const Faces& faces, const Vertices& vertices, int count);

/// About `count` vertices chosen evenly by area: those where the running share passes a multiple of 1 / count.
std::vector<std::int32_t> verticesByArea(const Faces& faces, const Vertices& vertices, int count);

/// About `count` rows, evenly by index; all of them where there are fewer.
SurfaceSamples everyFew(const Vertices& points, const Vertices& normals, int count);

}  // namespace shaped
