#pragma once

#include <Eigen/SparseCore>
#include <optional>

#include "core/skeleton/pose.h"

namespace shaped {

/// Share that each bone has in carrying each vertex: V x J, non-negative, rows summing to 1, compressed.
using SkinWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Limits of each joint's axis-angle vector, axis by axis.
struct JointLimits {
  Vertices low, high;  ///< J x 3, radians, low <= high
};

/// A skeleton in a mesh: what makes a surface posable.
struct Rig {
  Skeleton skeleton;
  Vertices rest_joints;  ///< J x 3: where the joints lie in the mesh at rest, m
  SkinWeights weights;   ///< V x J
  std::optional<JointLimits> limits;

  /// Throws InvalidInput naming the field unless the counts fit each other and `vertex_count`, everything is finite,
  /// weights are non-negative, each row sums to 1 within 1e-6, and no limit is above its counterpart.
  void requireValid(std::int32_t vertex_count) const;
};

/// Weights as they come from files, made to sum to 1 at every vertex. raw: V x J; duplicates must have been summed.
struct NormalisedWeights {
  SkinWeights weights;
  double largest_change;  ///< the largest |sum - 1| that was met
};

/// Throws InvalidInput naming `weights` and the vertex when one is negative, not finite, or a vertex has none at all.
NormalisedWeights normaliseWeights(const SkinWeights& raw);

}  // namespace shaped
