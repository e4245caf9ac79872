#include "core/curve/path_enrichment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/curve/flow_tangents.h"

namespace shaped {
namespace {

constexpr double kNegligible = 1e-3;        ///< of the largest displacement
constexpr std::size_t kMostDirections = 8;  ///< that join at once
constexpr double kUseful = 0.9;  ///< of what was missing, at most, is missing after a round that was worth its time

/// The columns' principal directions, the longest first, down to negligible ones.
std::vector<Eigen::VectorXd> principalDirections(const std::vector<Eigen::VectorXd>& vectors) {
  Eigen::MatrixXd columns(vectors.front().size(), static_cast<Eigen::Index>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = vectors[i];
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> gram(columns.transpose() * columns);
  std::vector<Eigen::VectorXd> directions;
  for (Eigen::Index j = columns.cols(); j-- > 0 && directions.size() < kMostDirections;) {
    if (!(gram.eigenvalues()[j] > kNegligible * kNegligible * gram.eigenvalues()[columns.cols() - 1])) break;
    directions.emplace_back(columns * gram.eigenvectors().col(j));
  }
  return directions;
}

}  // namespace

bool PathEnrichment::worthAnother(const PathEnrichment& last) const {
  return added > 0 && (last.added == 0 || missing <= kUseful * last.missing);
}

PathEnrichment enrich(const ShellStructurePtr& structure, double bending, GhostSpace& space,
                      const std::vector<PathCoordinates>& paths, double tolerance, const std::stop_token& stop) {
  PathEnrichment result;
  std::vector<Curve> curves;
  double displaced = 0, size = 0;
  for (const auto& path : paths) {
    curves.push_back({{}, false});
    for (const auto& coordinates : path) {
      const auto& shape = curves.back().frames.emplace_back(space.fine().shape(coordinates));
      size += (shape.rowwise() - shape.colwise().mean()).squaredNorm();
    }
  }
  std::vector<Eigen::VectorXd> displacements;
  for (const auto& tangents : flowTangents(structure, bending, curves, stop)) {
    if (stop.stop_requested()) return result;
    result.residual = std::max(result.residual, tangents.residual);
    for (const auto& displacement : tangents.displacements) {
      if (displacement.size() == 0) continue;
      displaced += displacement.squaredNorm();
      displacements.push_back(displacement);
    }
  }
  result.missing = std::sqrt(displaced / size);
  if (displacements.empty() || result.missing <= tolerance) return result;
  for (const auto& direction : principalDirections(displacements))
    if (space.append(direction)) ++result.added;
  return result;
}

}  // namespace shaped
