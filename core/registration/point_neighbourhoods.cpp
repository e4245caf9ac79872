#include "core/registration/point_neighbourhoods.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaped {
namespace {

/// The nearest points of one point, itself among them.
std::span<const NearPoint> neighbourhood(const PointTree& cloud, Eigen::Index point, std::vector<NearPoint>& buffer) {
  return {buffer.data(), cloud.nearest(cloud.points().row(point), buffer)};
}

Eigen::RowVector3d leastSpread(const Vertices& points, std::span<const NearPoint> near) {
  Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
  for (const auto& n : near) mean += points.row(n.index);
  mean /= static_cast<double>(near.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& n : near) scatter += (points.row(n.index) - mean).transpose() * (points.row(n.index) - mean);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread;
  spread.computeDirect(scatter);
  if (!(spread.eigenvalues()[1] > 1e-9 * spread.eigenvalues()[2])) return Eigen::RowVector3d::Zero();
  return spread.eigenvectors().col(0).transpose();
}

/// The widest angle [rad] between successive directions; a full turn for fewer than two.
double widestGap(std::vector<double>& angles) {
  if (angles.size() < 2) return 2 * std::numbers::pi;
  std::sort(angles.begin(), angles.end());
  double widest = angles.front() + 2 * std::numbers::pi - angles.back();
  for (std::size_t a = 1; a < angles.size(); ++a) widest = std::max(widest, angles[a] - angles[a - 1]);
  return widest;
}

}  // namespace

Vertices estimateNormals(const PointTree& cloud, int neighbours) {
  Vertices normals(cloud.points().rows(), 3);
  std::vector<NearPoint> buffer(static_cast<std::size_t>(neighbours) + 1);
  for (Eigen::Index p = 0; p < normals.rows(); ++p)
    normals.row(p) = leastSpread(cloud.points(), neighbourhood(cloud, p, buffer));
  return normals;
}

std::vector<bool> findRim(const PointTree& cloud, const Vertices& normals, bool oriented, const RimOptions& options) {
  const auto& points = cloud.points();
  std::vector<bool> rim(static_cast<std::size_t>(points.rows()));
  std::vector<NearPoint> buffer(static_cast<std::size_t>(options.neighbours) + 1);
  std::vector<double> angles;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const Eigen::RowVector3d normal = normals.row(p);
    if (normal.squaredNorm() == 0) continue;
    const Eigen::RowVector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    angles.clear();
    for (const auto& near : neighbourhood(cloud, p, buffer)) {
      if (near.index == p || (oriented && normals.row(near.index).dot(normal) < 0)) continue;
      const Eigen::RowVector3d to = points.row(near.index) - points.row(p);
      angles.push_back(std::atan2(to.dot(along), to.dot(across)));
    }
    rim[static_cast<std::size_t>(p)] = widestGap(angles) > options.widest_gap * std::numbers::pi / 180;
  }
  return rim;
}

}  // namespace shaped
