#include "core/skeleton/joint_regressor.h"

#include <Eigen/Eigenvalues>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Shares below this add nothing but noise to a cluster's mean.
constexpr double kLeastShare = 1e-3;

/// Vertices that speak for a joint, and how loudly.
struct Cluster {
  std::vector<Eigen::Index> vertices;
  Eigen::VectorXd shares;  ///< positive, sum 1
};

using Columns = Eigen::SparseMatrix<double>;

Cluster clusterOf(const Eigen::VectorXd& loudness) {
  Cluster cluster;
  const double least = kLeastShare * loudness.maxCoeff();
  std::vector<double> shares;
  for (Eigen::Index v = 0; v < loudness.size(); ++v)
    if (loudness[v] > least) {
      cluster.vertices.push_back(v);
      shares.push_back(loudness[v]);
    }
  cluster.shares = Eigen::Map<const Eigen::VectorXd>(shares.data(), Eigen::Index(shares.size()));
  if (!shares.empty()) cluster.shares /= cluster.shares.sum();
  return cluster;
}

/// What both the joint's bone and a neighbouring one carry.
Eigen::VectorXd shared(const Skeleton& skeleton, const Columns& weights, std::int32_t joint) {
  const auto product = [&](std::int32_t other) -> Eigen::VectorXd {
    return Eigen::VectorXd(weights.col(joint)).cwiseProduct(Eigen::VectorXd(weights.col(other)));
  };
  if (joint > 0) return product(skeleton.parent(joint));
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(weights.rows());
  for (std::int32_t child = 1; child < skeleton.jointCount(); ++child)
    if (skeleton.parent(child) == 0) sum += product(child);
  return sum;
}

Cluster jointCluster(const Skeleton& skeleton, const Columns& weights, std::int32_t joint) {
  // Some vertices, not a handful in one corner: they must surround the joint.
  constexpr std::size_t enough = 12;
  Cluster meeting = clusterOf(shared(skeleton, weights, joint));
  return meeting.vertices.size() >= enough ? meeting : clusterOf(Eigen::VectorXd(weights.col(joint)));
}

/// The clusters of all joints; none is empty.
std::vector<Cluster> jointClusters(const Rig& rig) {
  const Columns weights = rig.weights;
  std::vector<Cluster> clusters;
  for (std::int32_t j = 0; j < rig.skeleton.jointCount(); ++j)
    clusters.push_back(jointCluster(rig.skeleton, weights, j));
  for (std::int32_t j = rig.skeleton.jointCount() - 1; j > 0; --j) {
    auto& parent = clusters[std::size_t(rig.skeleton.parent(j))];
    if (parent.vertices.empty()) parent = clusters[std::size_t(j)];
  }
  for (std::int32_t j = 1; j < rig.skeleton.jointCount(); ++j)
    if (clusters[std::size_t(j)].vertices.empty())
      clusters[std::size_t(j)] = clusters[std::size_t(rig.skeleton.parent(j))];
  return clusters;
}

/// Minimises sum (c_v - s_v)^2 / s_v under sum c_v = 1, sum c_v v = joint: c = s (1 + affine function of v).
Eigen::VectorXd combination(const Cluster& cluster, const Vertices& rest, const Eigen::RowVector3d& joint) {
  const Eigen::Index n = cluster.shares.size();
  Vertices places(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) places.row(i) = rest.row(cluster.vertices[std::size_t(i)]);
  const Eigen::RowVector3d mean = cluster.shares.transpose() * places;
  const Vertices off = places.rowwise() - mean;
  const Eigen::Matrix3d spread = off.transpose() * cluster.shares.asDiagonal() * off;
  // Directions in which the cluster has no extent are left alone: a flat one must not be stretched to reach out of its
  // plane.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a)
    if (axes.eigenvalues()[a] > 1e-4 * axes.eigenvalues()[2])
      slope += axes.eigenvectors().col(a) *
               (axes.eigenvectors().col(a).dot((joint - mean).transpose()) / axes.eigenvalues()[a]);
  return cluster.shares.array() * (1 + (off * slope).array());
}

}  // namespace

JointRegressor clusterRegressor(const Rig& rig, const Vertices& rest) {
  rig.requireValid(std::int32_t(rest.rows()));
  const auto clusters = jointClusters(rig);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t j = 0; j < clusters.size(); ++j) {
    const Eigen::VectorXd row = combination(clusters[j], rest, rig.rest_joints.row(Eigen::Index(j)));
    for (Eigen::Index i = 0; i < row.size(); ++i)
      entries.emplace_back(Eigen::Index(j), clusters[j].vertices[std::size_t(i)], row[i]);
  }
  JointRegressor regressor(rig.skeleton.jointCount(), rest.rows());
  regressor.setFromTriplets(entries.begin(), entries.end());
  return regressor;
}

}  // namespace shaped
