#include "tests/fuzz/small_model.h"

#include <algorithm>

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

/// The upper half of a ball turns against the lower one.
BodyModel makeBody() {
  const auto ball = test::icosphere(1);
  const auto vertices = ball.vertices.rows();
  Skeleton skeleton({{"root", -1}, {"top", 0}});
  SkinWeights weights(vertices, 2);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const double share = std::clamp(0.5 + ball.vertices(v, 2), 0.0, 1.0);
    if (share < 1) weights.insert(v, 0) = 1 - share;
    if (share > 0) weights.insert(v, 1) = share;
  }
  weights.makeCompressed();
  const Rig rig{skeleton, Vertices::Zero(2, 3), weights, std::nullopt};
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(3 * vertices, 2);
  for (Eigen::Index v = 0; v < vertices; ++v)
    for (const int axis : {0, 1}) modes(3 * v + axis, axis) = ball.vertices(v, axis);
  modes.colwise().normalize();
  return BodyModel({ball.topology, ball.vertices, modes, Eigen::Vector2d(0.2, 0.1), skeleton, weights,
                    clusterRegressor(rig, ball.vertices),
                    JointLimits{Vertices::Constant(2, 3, -1), Vertices::Constant(2, 3, 2)}});
}

}  // namespace

const BodyModel& smallBody() {
  static const BodyModel model = makeBody();
  return model;
}

ShellPgaModelPtr smallModel() {
  static const auto model = std::make_shared<const ShellPgaModel>(makeParts());
  return model;
}

}  // namespace shaped::fuzz
