#include "core/sample/skin_weights.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <limits>

#include "core/sample/implicit_body.h"
#include "core/surface/laplacian.h"

namespace shaped {
namespace {

/// Conduction against exchange with the bone: larger gives sharper weights.
constexpr double kHold = 0.6;

/// The bone whose surface lies nearest, and the distance to its axis.
struct NearestBone {
  Eigen::Index bone = 0;
  double axis_distance = 0;
};

NearestBone nearestBone(const Eigen::Vector3d& point, const std::vector<Bone>& bones) {
  NearestBone nearest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const double distance = distanceToBone(bones[b], point);
    if (distance >= least) continue;
    least = distance;
    nearest = {Eigen::Index(b), std::max(distance + std::min(bones[b].joint_radius, bones[b].end_radius), 0.01)};
  }
  return nearest;
}

}  // namespace

Eigen::MatrixXd heatSkinWeights(const Vertices& vertices, const Faces& faces, const std::vector<Bone>& bones) {
  const auto areas = lumpedAreas(vertices, faces);
  Eigen::VectorXd hold(vertices.rows());
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(vertices.rows(), Eigen::Index(bones.size()));
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const auto nearest = nearestBone(vertices.row(v).transpose(), bones);
    hold[v] = kHold * areas[v] / (nearest.axis_distance * nearest.axis_distance);
    held(v, nearest.bone) = hold[v];
  }
  auto system = cotangentStiffness(vertices, faces, ObtuseCorners::kAsZero);  // weights then stay within [0, 1]
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) system.coeffRef(v, v) += hold[v];
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  Eigen::MatrixXd weights = solver.solve(held).cwiseMax(0);
  return weights.array().colwise() / weights.rowwise().sum().array();
}

}  // namespace shaped
