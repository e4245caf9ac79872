#include "core/skeleton/rig.h"

#include <cmath>

#include "core/numerics/error.h"

namespace shaped {
namespace {

std::string weightsOf(Eigen::Index vertex) { return "weights[" + std::to_string(vertex) + "]"; }

/// The sum of a vertex's weights, which are non-negative and finite.
double checkedSum(const SkinWeights& weights, Eigen::Index vertex) {
  double sum = 0;
  for (SkinWeights::InnerIterator entry(weights, vertex); entry; ++entry) {
    if (!std::isfinite(entry.value()) || entry.value() < 0)
      throw InvalidInput(weightsOf(vertex), "gives joint " + std::to_string(entry.col()) + " the weight " +
                                                std::to_string(entry.value()) + ", want one >= 0");
    sum += entry.value();
  }
  return sum;
}

void requireLimits(const JointLimits& limits, Eigen::Index joints) {
  if (limits.low.rows() != joints || limits.high.rows() != joints)
    throw InvalidInput("limits", "has " + std::to_string(limits.low.rows()) + " lower and " +
                                     std::to_string(limits.high.rows()) + " upper rows, want one for each of " +
                                     std::to_string(joints) + " joints");
  for (Eigen::Index j = 0; j < joints; ++j)
    if (!(limits.low.row(j).array() <= limits.high.row(j).array()).all())
      throw InvalidInput("limits[" + std::to_string(j) + "]", "has a lower limit above the upper one");
}

}  // namespace

void Rig::requireValid(std::int32_t vertex_count) const {
  poseSkeleton(skeleton, rest_joints, restPose(skeleton));
  if (weights.rows() != vertex_count)
    throw InvalidInput("weights", "is for " + std::to_string(weights.rows()) + " vertices, and the mesh has " +
                                      std::to_string(vertex_count));
  if (weights.cols() != skeleton.jointCount())
    throw InvalidInput("weights", "is for " + std::to_string(weights.cols()) + " joints, and the skeleton has " +
                                      std::to_string(skeleton.jointCount()));
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    const double sum = checkedSum(weights, v);
    if (std::abs(sum - 1) > 1e-6) throw InvalidInput(weightsOf(v), "sums to " + std::to_string(sum) + ", want 1");
  }
  if (limits) requireLimits(*limits, skeleton.jointCount());
}

NormalisedWeights normaliseWeights(const SkinWeights& raw) {
  NormalisedWeights result{raw, 0};
  for (Eigen::Index v = 0; v < raw.rows(); ++v) {
    const double sum = checkedSum(raw, v);
    if (sum == 0) throw InvalidInput(weightsOf(v), "are all zero: no bone carries this vertex");
    result.largest_change = std::max(result.largest_change, std::abs(sum - 1));
    for (SkinWeights::InnerIterator entry(result.weights, v); entry; ++entry) entry.valueRef() /= sum;
  }
  result.weights.prune(0.0);
  result.weights.makeCompressed();
  return result;
}

}  // namespace shaped
