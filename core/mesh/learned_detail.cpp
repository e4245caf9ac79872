#include "core/mesh/learned_detail.h"

#include <Eigen/Dense>
#include <algorithm>

namespace shaped {
namespace {

constexpr std::size_t kPositions = 16, kNormals = 8;
constexpr double kRidge = 1e-3;
constexpr std::size_t kCaution = 8;  ///< samples' worth of ridge on top, for small training sets
constexpr std::size_t kScaleNeighbour = 6;

using Weights = Eigen::VectorXd;

/// The regression of one fine vertex: its columns are frame vectors, the positions relative to the nearest.
class VertexFit {
 public:
  VertexFit(const SurfaceNeighbours& nearest, Eigen::Index coarse_count) : origin_(nearest.front().mark) {
    const auto positions = std::min(kPositions, nearest.size()), normals = std::min(kNormals, nearest.size());
    for (std::size_t i = 1; i < positions; ++i) rows_.push_back(nearest[i].mark);
    position_count_ = static_cast<Eigen::Index>(rows_.size());
    for (std::size_t i = 0; i < normals; ++i)
      rows_.push_back(static_cast<std::int32_t>(coarse_count) + nearest[i].mark);
    scale_ = nearest[std::min(kScaleNeighbour, nearest.size() - 1)].distance;
  }

  const std::vector<std::int32_t>& rows() const { return rows_; }
  Eigen::Index positionCount() const { return position_count_; }
  std::int32_t origin() const { return origin_; }

  Weights solve(std::int32_t vertex, const DetailSample& reference, const std::vector<DetailSample>& training) const {
    const auto count = static_cast<Eigen::Index>(rows_.size());
    Eigen::MatrixXd normal_matrix = Eigen::MatrixXd::Zero(count, count);
    Weights right = Weights::Zero(count);
    for (const auto& sample : training) {
      const auto columns = columnsOf(sample.frame);
      normal_matrix.selfadjointView<Eigen::Lower>().rankUpdate(columns.transpose());
      right += columns.transpose() * sample.missing.row(vertex).transpose();
    }
    const auto samples = static_cast<double>(training.size() + kCaution);
    normal_matrix.diagonal().array() += kRidge * samples * scale_ * scale_;
    const Eigen::LLT<Eigen::MatrixXd> factor(normal_matrix.selfadjointView<Eigen::Lower>());
    const Weights unconstrained = factor.solve(right);
    const auto constraint = columnsOf(reference.frame);
    const Eigen::Matrix<double, Eigen::Dynamic, 3> response = factor.solve(constraint.transpose());
    const Eigen::Vector3d excess = constraint * unconstrained - reference.missing.row(vertex).transpose();
    const Eigen::Matrix3d compliance = constraint * response;
    return unconstrained - response * compliance.ldlt().solve(excess);
  }

 private:
  Eigen::Matrix<double, 3, Eigen::Dynamic> columnsOf(const Vertices& frame) const {
    Eigen::Matrix<double, 3, Eigen::Dynamic> columns = frame(rows_, Eigen::all).transpose();
    columns.leftCols(position_count_).colwise() -= frame.row(origin_).transpose();
    return columns;
  }

  std::int32_t origin_;
  std::vector<std::int32_t> rows_;  ///< of the frame vectors
  Eigen::Index position_count_ = 0;
  double scale_ = 0;  ///< [m]
};

}  // namespace

std::optional<SparseRows> fitDetail(const std::vector<SurfaceNeighbours>& neighbours, const DetailSample& reference,
                                    const std::vector<DetailSample>& training, const std::stop_token& stop) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(neighbours.size() * (kPositions + kNormals));
  for (std::size_t v = 0; v < neighbours.size(); ++v) {
    if (stop.stop_requested()) return std::nullopt;
    const auto& nearest = neighbours[v];
    if (nearest.front().distance == 0) continue;
    const VertexFit fit(nearest, reference.frame.rows() / 2);
    const auto vertex = static_cast<std::int32_t>(v);
    const auto weights = fit.solve(vertex, reference, training);
    for (std::size_t i = 0; i < fit.rows().size(); ++i)
      triplets.emplace_back(vertex, fit.rows()[i], weights[static_cast<Eigen::Index>(i)]);
    triplets.emplace_back(vertex, fit.origin(), -weights.head(fit.positionCount()).sum());
  }
  SparseRows result(static_cast<Eigen::Index>(neighbours.size()), reference.frame.rows());
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

}  // namespace shaped
