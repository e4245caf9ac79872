#include "core/mesh/alignment.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <string>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Weighted first and second moments of two corresponding point sets.
struct Moments {
  double weight = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
  double source_spread = 0;                              ///< sum w |source - mean|^2
  double target_spread = 0;                              ///< sum w |target - mean|^2
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< sum w (target - mean) (source - mean)^T
};

double weightOf(const Eigen::VectorXd& weights, Eigen::Index i) { return weights.size() ? weights[i] : 1.0; }

void checkPoints(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights) {
  const auto n = source.rows();
  if (n < 1) throw InvalidInput("source", "has no points; alignment needs at least one");
  if (target.rows() != n)
    throw InvalidInput("target", "has " + std::to_string(target.rows()) + " points, want " + std::to_string(n));
  if (weights.size() != 0 && weights.size() != n)
    throw InvalidInput("weights", "has " + std::to_string(weights.size()) + " values, want " + std::to_string(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const double weight = weightOf(weights, i);
    if (!(weight >= 0) || !std::isfinite(weight))
      throw InvalidInput("weights[" + std::to_string(i) + "]", "must be a finite number >= 0");
    if (weight == 0) continue;
    for (const auto* points : {&source, &target})
      if (!points->row(i).allFinite())
        throw InvalidInput((points == &source ? "source[" : "target[") + std::to_string(i) + "]",
                           "is not finite; give it weight 0 to leave it out");
  }
}

Moments momentsOf(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights) {
  Moments m;
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    const double w = weightOf(weights, i);
    if (w == 0) continue;
    m.weight += w;
    m.source_mean += w * source.row(i).transpose();
    m.target_mean += w * target.row(i).transpose();
  }
  if (!(m.weight > 0)) throw InvalidInput("weights", "are all zero; at least one point must count");
  m.source_mean /= m.weight;
  m.target_mean /= m.weight;
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    const double w = weightOf(weights, i);
    if (w == 0) continue;
    const Eigen::Vector3d s = source.row(i).transpose() - m.source_mean, t = target.row(i).transpose() - m.target_mean;
    m.source_spread += w * s.squaredNorm();
    m.target_spread += w * t.squaredNorm();
    m.covariance += w * t * s.transpose();
  }
  return m;
}

/// The proper rotation R that maximises trace(R^T covariance).
Eigen::Matrix3d bestRotation(const Moments& m) {
  const double size = std::sqrt(m.source_spread * m.target_spread);  // an upper bound of the singular values' sum
  if (!(m.covariance.norm() > 1e-12 * size) || size == 0) return Eigen::Matrix3d::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (!(svd.singularValues()[1] > 1e-12 * svd.singularValues()[0]))  // on a line: turning about it changes nothing
    return Eigen::Quaterniond::FromTwoVectors(v.col(0), u.col(0)).toRotationMatrix();
  const Eigen::Vector3d signs(1, 1, u.determinant() * v.determinant() < 0 ? -1 : 1);
  return u * signs.asDiagonal() * v.transpose();
}

}  // namespace

RigidMotion alignRigidly(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights) {
  checkPoints(source, target, weights);
  const Moments m = momentsOf(source, target, weights);
  const Eigen::Matrix3d rotation = bestRotation(m);
  return {rotation, m.target_mean - rotation * m.source_mean};
}

SimilarityMotion alignSimilarly(const Vertices& source, const Vertices& target, const Eigen::VectorXd& weights) {
  checkPoints(source, target, weights);
  const Moments m = momentsOf(source, target, weights);
  const Eigen::Matrix3d rotation = bestRotation(m);
  const double overlap = std::max(0.0, (rotation.array() * m.covariance.array()).sum());
  const double scale = m.source_spread > 0 ? overlap / m.source_spread : 1.0;
  return {scale, rotation, m.target_mean - scale * (rotation * m.source_mean)};
}

Vertices apply(const RigidMotion& motion, const Vertices& vertices) {
  return (vertices * motion.rotation.transpose()).rowwise() + motion.translation.transpose();
}

Vertices apply(const SimilarityMotion& motion, const Vertices& vertices) {
  return (vertices * (motion.scale * motion.rotation).transpose()).rowwise() + motion.translation.transpose();
}

RigidMotion inverse(const RigidMotion& motion) {
  const Eigen::Matrix3d back = motion.rotation.transpose();
  return {back, -back * motion.translation};
}

}  // namespace shaped
