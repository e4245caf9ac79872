#include "core/sample/skin_weights.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "core/sample/implicit_body.h"

namespace shaped {
namespace {

/// Conduction against exchange with the bone: larger gives sharper weights.
constexpr double kHold = 0.6;

/// Cotangent stiffness and vertex areas. Negative cotangents count as zero: weights then stay within [0, 1].
struct SurfaceOperator {
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd areas;
};

SurfaceOperator surfaceOperator(const Vertices& vertices, const Faces& faces) {
  std::vector<Eigen::Triplet<double>> entries;
  SurfaceOperator result{Eigen::SparseMatrix<double>(vertices.rows(), vertices.rows()),
                         Eigen::VectorXd::Zero(vertices.rows())};
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c) {
      const int at = faces(f, c), i = faces(f, (c + 1) % 3), j = faces(f, (c + 2) % 3);
      const Eigen::RowVector3d a = vertices.row(i) - vertices.row(at), b = vertices.row(j) - vertices.row(at);
      const double double_area = a.cross(b).norm();
      const double weight = 0.5 * std::max(a.dot(b) / double_area, 0.0);
      result.areas[at] += double_area / 6;
      for (const auto& [row, column, sign] : {std::tuple{i, i, 1}, {j, j, 1}, {i, j, -1}, {j, i, -1}})
        entries.emplace_back(row, column, sign * weight);
    }
  result.stiffness.setFromTriplets(entries.begin(), entries.end());
  return result;
}

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
  const auto surface = surfaceOperator(vertices, faces);
  Eigen::VectorXd hold(vertices.rows());
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(vertices.rows(), Eigen::Index(bones.size()));
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const auto nearest = nearestBone(vertices.row(v).transpose(), bones);
    hold[v] = kHold * surface.areas[v] / (nearest.axis_distance * nearest.axis_distance);
    held(v, nearest.bone) = hold[v];
  }
  Eigen::SparseMatrix<double> system = surface.stiffness;
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) system.coeffRef(v, v) += hold[v];
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  Eigen::MatrixXd weights = solver.solve(held).cwiseMax(0);
  return weights.array().colwise() / weights.rowwise().sum().array();
}

}  // namespace shaped
