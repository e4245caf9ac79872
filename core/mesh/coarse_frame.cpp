#include "core/mesh/coarse_frame.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace shaped {
namespace {

constexpr double kSmallestSpread = 1e-3;  ///< of a one-ring's directions, relative to its widest
constexpr double kSmallestNormal = 0.1;   ///< relative to the mean edge; about 2.3 where triangles are even
constexpr double kNormalShare = 0.5;      ///< weight of the normal against all edges together

/// The inverse of a symmetric positive semi-definite matrix with its small eigenvalues raised.
Eigen::Matrix3d boundedInverse(const Eigen::Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
  const Eigen::Vector3d values = eigen.eigenvalues().cwiseMax(kSmallestSpread * eigen.eigenvalues()[2]);
  return eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
}

GradientStencil stencilOf(std::int32_t vertex, const std::vector<std::int32_t>& ring, const Vertices& frame) {
  const auto count = static_cast<std::int32_t>(frame.rows() / 2);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> pulls;
  for (const auto neighbour : ring) {
    const Eigen::Vector3d edge = (frame.row(neighbour) - frame.row(vertex)).transpose();
    pulls.push_back(edge / edge.norm());
    spread += pulls.back() * edge.transpose();
  }
  const Eigen::Vector3d normal = frame.row(count + vertex).transpose();
  const double mean_edge = spread.trace() / static_cast<double>(ring.size());
  const double squared = std::max(normal.squaredNorm(), std::pow(kSmallestNormal * mean_edge, 2));
  const Eigen::Vector3d normal_pull = kNormalShare * spread.trace() / squared * normal;
  spread += normal_pull * normal.transpose();
  const Eigen::Matrix3d inverse = boundedInverse(spread);

  GradientStencil stencil;
  Eigen::Vector3d own = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    stencil.terms.push_back({ring[i], inverse * pulls[i]});
    own -= stencil.terms.back().weight;
  }
  stencil.terms.push_back({vertex, own});
  stencil.terms.push_back({count + vertex, inverse * normal_pull});
  return stencil;
}

}  // namespace

Vertices frameVectors(const Faces& coarse_faces, const Vertices& coarse) {
  const auto count = coarse.rows();
  Vertices frame = Vertices::Zero(2 * count, 3);
  frame.topRows(count) = coarse;
  for (Eigen::Index f = 0; f < coarse_faces.rows(); ++f) {
    const Eigen::RowVector3d origin = coarse.row(coarse_faces(f, 0));
    const Eigen::RowVector3d normal =
        (coarse.row(coarse_faces(f, 1)) - origin).cross(coarse.row(coarse_faces(f, 2)) - origin);
    for (int c = 0; c < 3; ++c) frame.row(count + coarse_faces(f, c)) += normal;
  }
  for (Eigen::Index v = count; v < 2 * count; ++v) {
    const double length = frame.row(v).norm();
    if (length > 0) frame.row(v) /= std::sqrt(length);
  }
  return frame;
}

std::vector<GradientStencil> gradientStencils(const Topology& coarse, const Vertices& reference) {
  std::vector<std::vector<std::int32_t>> rings(static_cast<std::size_t>(coarse.vertexCount()));
  for (const auto& [a, b] : coarse.edges()) {
    rings[a].push_back(b);
    rings[b].push_back(a);
  }
  const auto frame = frameVectors(coarse.faces(), reference);
  std::vector<GradientStencil> stencils;
  for (std::int32_t v = 0; v < coarse.vertexCount(); ++v) stencils.push_back(stencilOf(v, rings[v], frame));
  return stencils;
}

}  // namespace shaped
