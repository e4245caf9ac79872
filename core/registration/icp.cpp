#include "core/registration/icp.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace shaped {
namespace {

Eigen::RowVector3d move(const SimilarityMotion& placement, const Eigen::RowVector3d& point) {
  return placement.scale * (point * placement.rotation.transpose()) + placement.translation.transpose();
}

Eigen::RowVector3d moveBack(const SimilarityMotion& placement, const Eigen::RowVector3d& point) {
  return (point - placement.translation.transpose()) * placement.rotation / placement.scale;
}

/// The share-quantile of values.
double quantile(Eigen::VectorXd values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Turns squared distances into weights (Geman and McClure, with the root mean square of the nearest `share` for its
/// scale; none beyond three times that quantile) and returns the mean square of the nearest share.
double weigh(const Eigen::VectorXd& squares, double share, Eigen::Ref<Eigen::VectorXd> weights) {
  const double limit = quantile(squares, share);
  double sum = 0, count = 0;
  for (const double square : squares)
    if (square <= limit) sum += square, ++count;
  const double mean = sum / count, scale = 4 * mean + 1e-300;
  for (Eigen::Index i = 0; i < squares.size(); ++i)
    weights[i] *= squares[i] <= limit ? std::pow(scale / (scale + squares[i]), 2) : 0;
  return mean;
}

}  // namespace

double Icp::clampScale(double scale) const {
  return std::clamp(scale, 1 / options_.largest_scale, options_.largest_scale);
}

double Icp::normalWeight(const Eigen::RowVector3d& one, const Eigen::RowVector3d& other) const {
  const double cosine = one.dot(other);
  return 0.05 + (options_.oriented ? std::max(0.0, cosine) : std::abs(cosine));
}

double Icp::appendScanPairs(const SimilarityMotion& placement, IcpPairs& pairs, Eigen::Index first) const {
  const auto& sparse = scan_.sparse();
  Eigen::VectorXd squares(sparse.points.rows());
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    const NearPoint near = model_.tree().nearest(moveBack(placement, sparse.points.row(i)));
    squares[i] = placement.scale * placement.scale * near.squared_distance;
    pairs.model.row(first + i) = model_.dense().points.row(near.index);
    pairs.normals.row(first + i) = model_.dense().normals.row(near.index);
    pairs.scan.row(first + i) = sparse.points.row(i);
    pairs.weights[first + i] =
        normalWeight(model_.dense().normals.row(near.index) * placement.rotation.transpose(), sparse.normals.row(i));
  }
  return weigh(squares, options_.scan_share, pairs.weights.segment(first, squares.size()));
}

void Icp::appendModelPairs(const SimilarityMotion& placement, IcpPairs& pairs, Eigen::Index first,
                           Eigen::VectorXd& squares) const {
  const auto& sparse = model_.sparse();
  squares.resize(sparse.points.rows());
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    const NearPoint near = scan_.tree().nearest(move(placement, sparse.points.row(i)));
    squares[i] = near.squared_distance;
    pairs.model.row(first + i) = sparse.points.row(i);
    pairs.normals.row(first + i) = sparse.normals.row(i);
    pairs.scan.row(first + i) = scan_.dense().points.row(near.index);
    pairs.weights[first + i] =
        normalWeight(sparse.normals.row(i) * placement.rotation.transpose(), scan_.dense().normals.row(near.index));
  }
}

IcpPairs Icp::pair(const SimilarityMotion& placement) const {
  const auto scan_count = scan_.sparse().points.rows(), model_count = model_.sparse().points.rows();
  const auto count = scan_count + model_count;
  IcpPairs pairs{Vertices(count, 3), Vertices(count, 3), Vertices(count, 3), Eigen::VectorXd(count), 0, 0};
  const double scan_square = appendScanPairs(placement, pairs, 0);
  Eigen::VectorXd squares;
  appendModelPairs(placement, pairs, scan_count, squares);
  const double model_square = weigh(squares, options_.template_share, pairs.weights.tail(model_count));
  pairs.score = std::sqrt(0.5 * (scan_square + model_square));
  pairs.overlap = static_cast<double>((squares.array() <= 9 * scan_square).count()) / static_cast<double>(model_count);
  return pairs;
}

SimilarityMotion Icp::stepToPoints(const IcpPairs& pairs) const {
  SimilarityMotion step = alignSimilarly(pairs.model, pairs.scan, pairs.weights);
  const double scale = clampScale(step.scale);
  if (scale == step.scale) return step;
  // The scale moves the points about their weighted mean, which stays where it is.
  const Eigen::Vector3d mean = pairs.model.transpose() * pairs.weights / pairs.weights.sum();
  step.translation += (step.scale - scale) * (step.rotation * mean);
  step.scale = scale;
  return step;
}

SimilarityMotion Icp::stepToPlanes(const IcpPairs& pairs, const SimilarityMotion& placement) const {
  Eigen::Matrix<double, 7, 7> normal_matrix = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
  double turning = 0, total = 0;
  for (Eigen::Index i = 0; i < pairs.weights.size(); ++i) {
    if (pairs.weights[i] == 0) continue;
    const Eigen::Vector3d arm = placement.scale * (placement.rotation * pairs.model.row(i).transpose());
    const Eigen::Vector3d normal = placement.rotation * pairs.normals.row(i).transpose();
    Eigen::Matrix<double, 7, 1> row;
    row.head<3>() = arm.cross(normal);
    row.segment<3>(3) = normal;
    row[6] = arm.dot(normal);
    normal_matrix += pairs.weights[i] * row * row.transpose();
    right += pairs.weights[i] * normal.dot(pairs.scan.row(i).transpose() - placement.translation - arm) * row;
    turning += pairs.weights[i] * arm.squaredNorm();
    total += pairs.weights[i];
  }
  // A surface of revolution leaves turns about its axis open: they then stay as they are.
  normal_matrix.diagonal().array() += 1e-6 * turning;
  normal_matrix.diagonal().segment<3>(3).array() += 1e-6 * (total - turning);
  const Eigen::Matrix<double, 7, 1> step = normal_matrix.ldlt().solve(right);
  SimilarityMotion next = placement;
  const double angle = step.head<3>().norm(), kept = std::min(1.0, 0.5 / std::max(angle, 1e-300));
  if (angle > 0)
    next.rotation = Eigen::AngleAxisd(kept * angle, step.head<3>() / angle).toRotationMatrix() * placement.rotation;
  next.translation += kept * step.segment<3>(3);
  next.scale = clampScale(placement.scale * std::exp(kept * step[6]));
  return next;
}

}  // namespace shaped
