#include "core/mesh/thin_plate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"

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

/// V x 2C: the Laplacian of the mapped reference from the frame vectors.
SparseRows mappedLaplacian(const Topology& fine, const Vertices& reference, const std::vector<double>& edge_weights,
                           const std::vector<SurfaceNeighbours>& neighbours,
                           const std::vector<GradientStencil>& stencils) {
  Triplets triplets;
  for (std::size_t e = 0; e < fine.edges().size(); ++e) {
    const auto [a, b] = fine.edges()[e];
    const Eigen::Vector3d edge = (reference.row(a) - reference.row(b)).transpose();
    for (const auto end : {a, b})
      for (const auto& [mark, weight] : blendWeights(neighbours[end]))
        for (const auto& term : stencils[mark].terms) {
          const double pull = 0.5 * edge_weights[e] * weight * term.weight.dot(edge);
          triplets.emplace_back(a, term.row, pull);
          triplets.emplace_back(b, term.row, -pull);
        }
  }
  SparseRows result(fine.vertexCount(), 2 * static_cast<Eigen::Index>(stencils.size()));
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
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

ThinPlate::ThinPlate(const Topology& fine, const Coarsening& coarsening, const Vertices& reference,
                     const std::vector<SurfaceNeighbours>& neighbours)
    : kept_(coarsening.kept) {
  std::vector<std::int32_t> all(static_cast<std::size_t>(fine.vertexCount()));
  std::iota(all.begin(), all.end(), 0);
  std::set_difference(all.begin(), all.end(), kept_.begin(), kept_.end(), std::back_inserter(free_));
  if (free_.empty()) return;

  const auto weights = edgeWeights(fine, reference);
  const auto stencils = gradientStencils(*coarsening.coarse, restrictTo(coarsening, reference));
  const SparseRows whole = laplacian(fine, weights);
  const SparseRows mapped = mappedLaplacian(fine, reference, weights, neighbours, stencils);
  const SparseRows free_rows = picking(free_, fine.vertexCount());
  const SparseRows weighted = free_rows * whole * inverseAreas(fine, reference).asDiagonal();
  const SparseRows hessian = weighted * whole;  // of |L x - d|^2 / 2: free x V
  const SparseRows from_reference = weighted * mapped, from_kept = hessian * spreading(kept_, fine.vertexCount());
  pull_ = from_reference - from_kept;
  factor_.compute(Eigen::SparseMatrix<double>(hessian * SparseRows(free_rows.transpose())));
  if (factor_.info() != Eigen::Success)
    throw InvalidInput("reference", "has triangles too thin to carry detail over from the coarse mesh; repair it");
}

std::size_t ThinPlate::bytes() const {
  if (free_.empty()) return 0;
  return bytesOf(pull_) + bytesOf(factor_.matrixL().nestedExpression());
}

Vertices ThinPlate::solve(const Vertices& frame) const {
  Vertices shape(static_cast<Eigen::Index>(kept_.size() + free_.size()), 3);
  shape(kept_, Eigen::all) = frame.topRows(static_cast<Eigen::Index>(kept_.size()));
  if (free_.empty()) return shape;
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  const Columns pull = pull_ * frame;
  const Columns between = factor_.solve(pull);  // Eigen 3.4 solves wrongly straight into indexed rows
  shape(free_, Eigen::all) = between;
  return shape;
}

}  // namespace shaped
