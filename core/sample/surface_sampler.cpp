#include "core/sample/surface_sampler.h"

#include <algorithm>
#include <string>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

void requireMesh(const Vertices& vertices, const Faces& faces) {
  if (faces.rows() == 0) throw InvalidInput("faces", "there are none; want a mesh");
  for (Eigen::Index v = 0; v < vertices.rows(); ++v)
    if (!vertices.row(v).allFinite())
      throw InvalidInput("vertices[" + std::to_string(v) + "]", "has a coordinate that is not finite");
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    if (faces.row(f).minCoeff() < 0 || faces.row(f).maxCoeff() >= vertices.rows())
      throw InvalidInput("faces[" + std::to_string(f) + "]",
                         "has an index outside [0, " + std::to_string(vertices.rows()) + ")");
}

}  // namespace

SurfaceSampler::SurfaceSampler(const Vertices& vertices, const Faces& faces) {
  requireMesh(vertices, faces);
  double sum = 0;
  for (const double area : triangleAreas(faces, vertices)) area_up_to_.push_back(sum += area);
  if (!(sum > 0)) throw InvalidInput("faces", "no face has area");
}

SurfaceSample SurfaceSampler::operator()(Random& random) const {
  // Strictly above: a face without area is never drawn.
  const double target = random.uniform() * area_up_to_.back();
  auto found = std::upper_bound(area_up_to_.begin(), area_up_to_.end(), target);
  if (found == area_up_to_.end()) found = std::lower_bound(area_up_to_.begin(), area_up_to_.end(), area_up_to_.back());
  // The square root spreads the points evenly over the triangle.
  const double root = std::sqrt(random.uniform()), along = random.uniform();
  return {static_cast<std::int32_t>(found - area_up_to_.begin()),
          Eigen::RowVector3d(1 - root, root * (1 - along), root * along)};
}

Eigen::RowVector3d at(const SurfaceSample& sample, const Faces& faces, const Vertices& rows) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (int c = 0; c < 3; ++c) sum += sample.barycentric[c] * rows.row(faces(sample.face, c));
  return sum;
}

}  // namespace shaped
