#include "tests/fuzz/small_model.h"

#include "tests/support/shapes.h"

namespace shaped::fuzz {
namespace {

Vertices stretched(Vertices shape, int axis, double factor) {
  shape.col(axis) *= factor;
  return shape;
}

ShellPgaParts makeParts() {
  const auto fine = test::icosphere(1), coarse = test::icosphere(0);
  ShellPgaParts parts;
  parts.topology = fine.topology;
  parts.template_shape = parts.reference = fine.vertices;
  parts.coarsening.coarse = coarse.topology;
  for (std::int32_t v = 0; v < coarse.topology->vertexCount(); ++v) parts.coarsening.kept.push_back(v);
  parts.detail.resize(fine.topology->vertexCount(), 2 * coarse.topology->vertexCount());
  parts.detail.insert(20, 3) = 0.01;
  parts.bending = 1e-3;
  parts.pga.mean = coarse.vertices;
  parts.pga.eigenvalues.resize(3);
  parts.pga.eigenvalues << 0.02, 0.01, 0;
  parts.pga.eigenvectors = Eigen::MatrixXd::Identity(3, 2);
  std::vector<Vertices> variations;
  for (const double factor : {1.1, 1 / 1.1})
    for (const int axis : {0, 1}) variations.push_back(stretched(coarse.vertices, axis, factor));
  parts.pga.variations = ShapeStack(variations);
  parts.training.shapes = 3;
  return parts;
}

}  // namespace

ShellPgaModelPtr smallModel() {
  static const auto model = std::make_shared<const ShellPgaModel>(makeParts());
  return model;
}

}  // namespace shaped::fuzz
