#include "core/registration/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/deformation.h"

namespace shaped {
namespace {

double fraction(double x) { return x - std::floor(x); }

/// Barycentric weights of the i-th point of the R2 sequence (Roberts 2018), folded into the triangle.
Eigen::RowVector3d spreadInTriangle(int i) {
  const double plastic = 1.32471795724474602596;
  double u = fraction(0.5 + i / plastic), v = fraction(0.5 + i / (plastic * plastic));
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return {1 - u - v, u, v};
}

}  // namespace

SurfaceSamples sampleByArea(const Faces& faces, const Vertices& vertices, int count) {
  const Eigen::VectorXd areas = triangleAreas(faces, vertices);
  const double total = areas.sum();
  if (!(total > 0)) throw InvalidInput("faces", "none has area, so there is no surface to sample");
  const Vertices normals = faceNormals(faces, vertices);
  SurfaceSamples samples{Vertices(count, 3), Vertices(count, 3)};
  Eigen::Index face = 0;
  double passed = areas[0];
  for (int i = 0; i < count; ++i) {
    while (passed < (i + 0.5) / count * total && face + 1 < faces.rows()) passed += areas[++face];
    const Eigen::RowVector3d weights = spreadInTriangle(i);
    samples.points.row(i) = weights[0] * vertices.row(faces(face, 0)) + weights[1] * vertices.row(faces(face, 1)) +
                            weights[2] * vertices.row(faces(face, 2));
    samples.normals.row(i) = normals.row(face);
  }
  return samples;
}

std::vector<std::int32_t> verticesByArea(const Faces& faces, const Vertices& vertices, int count) {
  const Eigen::VectorXd shares = areaShares(faces, vertices);
  std::vector<std::int32_t> chosen;
  double passed = 0;
  for (Eigen::Index v = 0; v < shares.size(); ++v) {
    const double before = std::floor(passed * count);
    passed += shares[v];
    if (std::floor(passed * count) > before) chosen.push_back(std::int32_t(v));
  }
  return chosen;
}

SurfaceSamples everyFew(const Vertices& points, const Vertices& normals, int count) {
  const Eigen::Index taken = std::min<Eigen::Index>(count, points.rows());
  SurfaceSamples samples{Vertices(taken, 3), Vertices(taken, 3)};
  for (Eigen::Index i = 0; i < taken; ++i) {
    const Eigen::Index row = i * points.rows() / taken;
    samples.points.row(i) = points.row(row);
    samples.normals.row(i) = normals.row(row);
  }
  return samples;
}

}  // namespace shaped
