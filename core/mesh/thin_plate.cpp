#include "core/mesh/thin_plate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/numerics/long_piece.h"

namespace shaped {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr std::size_t kBlended = 6;       ///< coarse vertices whose gradients meet in a fine vertex
constexpr double kSmallestWeight = 0.05;  ///< of an edge in the Laplacian
constexpr double kLargestWeight = 5;
constexpr double kSmallestAreaShare = 1e-4;  ///< of a vertex, relative to the mean

/// Half the sum of the cotangents opposite each edge, clamped.
std::vector<double> edgeWeights(const Topology& topology, const Vertices& shape) {
  std::vector<double> weights(topology.edges().size(), 0);
  const auto& faces = topology.faces();
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c) {
      const Eigen::RowVector3d apex = shape.row(faces(f, c));
      const Eigen::RowVector3d a = shape.row(faces(f, (c + 1) % 3)) - apex, b = shape.row(faces(f, (c + 2) % 3)) - apex;
      weights[topology.faceEdges()[f][c]] += 0.5 * a.dot(b) / a.cross(b).norm();
    }
  for (auto& weight : weights) weight = std::clamp(weight, kSmallestWeight, kLargestWeight);
  return weights;
}

/// One over the area around each vertex.
Eigen::VectorXd inverseAreas(const Topology& topology, const Vertices& shape) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(topology.vertexCount());
  const auto triangles = triangleAreas(topology.faces(), shape);
  for (Eigen::Index f = 0; f < triangles.size(); ++f)
    for (int c = 0; c < 3; ++c) areas[topology.faces()(f, c)] += triangles[f] / 3;
  return areas.cwiseMax(kSmallestAreaShare * areas.mean()).cwiseInverse();
}

/// Which coarse vertices' gradients act on a fine vertex, with weights that sum to 1; on a kept vertex only its own.
SurfaceNeighbours blendWeights(const SurfaceNeighbours& nearest) {
  if (nearest.front().distance == 0 || nearest.size() == 1) return {{nearest.front().mark, 1.0}};
  const auto count = std::min(kBlended, nearest.size() - 1);
  const double radius = nearest[count].distance * (1 + 1e-4);  // the farthest counts for almost nothing
  SurfaceNeighbours weights;
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    weights.push_back({nearest[i].mark, 1 / nearest[i].distance - 1 / radius});
    sum += weights.back().distance;
  }
  for (auto& weight : weights) weight.distance /= sum;
  return weights;
}

/// Sums up one row after another of a sparse matrix.
class RowByRow {
 public:
  RowByRow(Eigen::Index rows, Eigen::Index columns) : matrix_(rows, columns), row_(Eigen::VectorXd::Zero(columns)) {}

  void add(std::int32_t column, double value) {
    if (row_[column] == 0) columns_.push_back(column);  // perhaps again, where the sum came out as zero
    row_[column] += value;
  }

  void finishRow(Eigen::Index row) {
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    matrix_.startVec(row);
    for (const auto column : columns_) {
      matrix_.insertBack(row, column) = row_[column];
      row_[column] = 0;
    }
    columns_.clear();
  }

  SparseRows take() {
    matrix_.finalize();
    return std::move(matrix_);
  }

 private:
  SparseRows matrix_;
  Eigen::VectorXd row_;
  std::vector<std::int32_t> columns_;  ///< of the row's entries
};

/// What holds a vertex to its neighbours.
struct Spoke {
  std::int32_t to;
  double weight;
};

std::vector<std::vector<Spoke>> spokesOf(const Topology& topology, const std::vector<double>& edge_weights) {
  std::vector<std::vector<Spoke>> spokes(static_cast<std::size_t>(topology.vertexCount()));
  for (std::size_t e = 0; e < edge_weights.size(); ++e) {
    const auto [a, b] = topology.edges()[e];
    spokes[a].push_back({b, edge_weights[e]});
    spokes[b].push_back({a, edge_weights[e]});
  }
  return spokes;
}

/// V x 2C: the Laplacian of the mapped reference from the frame vectors. Each edge is mapped by the mean of the maps at
/// its ends. Unfinished once the stop token has fired.
SparseRows mappedLaplacian(const Topology& fine, const Vertices& reference, const std::vector<double>& edge_weights,
                           const std::vector<SurfaceNeighbours>& neighbours,
                           const std::vector<GradientStencil>& stencils, const std::stop_token& stop) {
  std::vector<SurfaceNeighbours> blends;
  for (const auto& nearest : neighbours) blends.push_back(blendWeights(nearest));
  RowByRow rows(fine.vertexCount(), 2 * static_cast<Eigen::Index>(stencils.size()));
  const auto add = [&](std::int32_t mapped_at, const Eigen::Vector3d& vector) {
    for (const auto& [mark, weight] : blends[mapped_at])
      for (const auto& term : stencils[mark].terms) rows.add(term.row, weight * term.weight.dot(vector));
  };
  const auto spokes = spokesOf(fine, edge_weights);
  for (std::int32_t a = 0; a < fine.vertexCount() && !stop.stop_requested(); ++a) {
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
    for (const auto& [b, weight] : spokes[a]) {
      const Eigen::Vector3d pull = 0.5 * weight * (reference.row(a) - reference.row(b)).transpose();
      own += pull;
      add(b, pull);
    }
    add(a, own);
    rows.finishRow(a);
  }
  return rows.take();
}

SparseRows laplacian(const Topology& topology, const std::vector<double>& edge_weights) {
  Triplets triplets;
  for (std::size_t e = 0; e < edge_weights.size(); ++e) {
    const auto [a, b] = topology.edges()[e];
    for (const auto& [row, column, sign] : {std::tuple{a, a, 1}, {b, b, 1}, {a, b, -1}, {b, a, -1}})
      triplets.emplace_back(row, column, sign * edge_weights[e]);
  }
  SparseRows result(topology.vertexCount(), topology.vertexCount());
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

/// Picks the chosen rows out of V, to the left of a matrix: chosen x V.
SparseRows picking(const std::vector<std::int32_t>& chosen, Eigen::Index count) {
  Triplets triplets;
  for (std::size_t i = 0; i < chosen.size(); ++i) triplets.emplace_back(static_cast<int>(i), chosen[i], 1.0);
  SparseRows result(static_cast<Eigen::Index>(chosen.size()), count);
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

/// Spreads frame vectors onto the fine mesh: the positions to the kept vertices, V x 2C.
SparseRows spreading(const std::vector<std::int32_t>& kept, Eigen::Index count) {
  Triplets triplets;
  for (std::size_t i = 0; i < kept.size(); ++i) triplets.emplace_back(kept[i], static_cast<int>(i), 1.0);
  SparseRows result(count, 2 * static_cast<Eigen::Index>(kept.size()));
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

}  // namespace

ThinPlate::ThinPlate(const Topology& fine, const Coarsening& coarsening) : kept_(coarsening.kept) {
  std::vector<std::int32_t> all(static_cast<std::size_t>(fine.vertexCount()));
  std::iota(all.begin(), all.end(), 0);
  std::set_difference(all.begin(), all.end(), kept_.begin(), kept_.end(), std::back_inserter(free_));
}

std::shared_ptr<const ThinPlate> ThinPlate::make(const Topology& fine, const Coarsening& coarsening,
                                                 const Vertices& reference,
                                                 const std::vector<SurfaceNeighbours>& neighbours,
                                                 const std::stop_token& stop) {
  const std::shared_ptr<ThinPlate> plate(new ThinPlate(fine, coarsening));
  const bool whole = plate->free_.empty() || plate->assemble(fine, coarsening, reference, neighbours, stop);
  return whole ? plate : nullptr;
}

bool ThinPlate::assemble(const Topology& fine, const Coarsening& coarsening, const Vertices& reference,
                         const std::vector<SurfaceNeighbours>& neighbours, const std::stop_token& stop) {
  if (stop.stop_requested()) return false;
  const auto weights = edgeWeights(fine, reference);
  const auto stencils = gradientStencils(*coarsening.coarse, restrictTo(coarsening, reference));
  const SparseRows whole = laplacian(fine, weights);
  const SparseRows mapped = mappedLaplacian(fine, reference, weights, neighbours, stencils, stop);
  if (stop.stop_requested()) return false;
  const LongPiece piece("products of a thin plate");
  const SparseRows free_rows = picking(free_, fine.vertexCount());
  const SparseRows weighted = free_rows * whole * inverseAreas(fine, reference).asDiagonal();
  const SparseRows hessian = weighted * whole;  // of |L x - d|^2 / 2: free x V
  if (stop.stop_requested()) return false;
  const SparseRows from_reference = weighted * mapped, from_kept = hessian * spreading(kept_, fine.vertexCount());
  if (stop.stop_requested()) return false;
  pull_ = from_reference - from_kept;
  if (factor_.compute(hessian * SparseRows(free_rows.transpose()), stop)) return true;
  if (stop.stop_requested()) return false;
  throw InvalidInput("reference", "has triangles too thin to carry detail over from the coarse mesh; repair it");
}

std::size_t ThinPlate::bytes() const {
  if (free_.empty()) return 0;
  return bytesOf(pull_) + factor_.bytes();
}

Vertices ThinPlate::solve(const Vertices& frame) const {
  Vertices shape(static_cast<Eigen::Index>(kept_.size() + free_.size()), 3);
  shape(kept_, Eigen::all) = frame.topRows(static_cast<Eigen::Index>(kept_.size()));
  if (free_.empty()) return shape;
  shape(free_, Eigen::all) = factor_.solve(pull_ * frame);
  return shape;
}

}  // namespace shaped
