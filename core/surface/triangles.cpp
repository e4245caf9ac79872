#include "core/surface/triangles.h"

#include <string>

#include "core/numerics/error.h"

namespace shaped {

void requireTriangles(const Vertices& vertices, const Faces& faces) {
  if (faces.rows() == 0) throw InvalidInput("faces", "a surface needs at least one face");
  if (!vertices.allFinite()) throw InvalidInput("vertices", "hold a coordinate that is not a finite number");
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    if (faces.row(f).minCoeff() < 0 || faces.row(f).maxCoeff() >= vertices.rows())
      throw InvalidInput("faces[" + std::to_string(f) + "]",
                         "has a vertex index outside [0, " + std::to_string(vertices.rows()) + ")");
}

}  // namespace shaped
