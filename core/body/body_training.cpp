#include "core/body/body_training.h"

#include <oneapi/tbb/parallel_for.h>

#include <cmath>

#include "core/mesh/alignment.h"
#include "core/numerics/error.h"
#include "core/statistics/linear_pca.h"

namespace shaped {
namespace {

std::vector<Vertices> normalisedAll(const PostureTemplate& reference, const std::vector<Vertices>& registrations,
                                    const BodyTrainingOptions& options) {
  for (std::size_t i = 0; i < registrations.size(); ++i)
    requireValidShape(*reference.topology, registrations[i], "registrations[" + std::to_string(i) + "]");
  std::vector<Vertices> normalised(registrations.size());
  tbb::parallel_for(std::size_t(0), registrations.size(), [&](std::size_t i) {
    if (!options.stop.stop_requested())
      normalised[i] = normalisedPosture(reference, registrations[i], options.posture, options.reach);
  });
  return normalised;
}

Eigen::Index modesToKeep(const Eigen::VectorXd& variances, const BodyTrainingOptions& options) {
  if (options.modes > 0) return std::min<Eigen::Index>(options.modes, variances.size());
  const double wanted = options.explained * variances.sum();
  Eigen::Index kept = 0;
  for (double sum = 0; kept < variances.size() && sum < wanted; ++kept) sum += variances[kept];
  return kept;
}

/// The modes turned as the mean is.
Eigen::MatrixXd turned(const Eigen::MatrixXd& modes, const Eigen::Matrix3d& rotation) {
  Eigen::MatrixXd result(modes.rows(), modes.cols());
  for (Eigen::Index row = 0; row < modes.rows(); row += 3)
    result.middleRows<3>(row) = rotation * modes.middleRows<3>(row);
  return result;
}

}  // namespace

std::optional<std::string> BodyTrainingOptions::firstViolation() const {
  if (!(reach > 0) || !std::isfinite(reach)) return "reach = " + std::to_string(reach) + ", want > 0";
  if (modes < 0) return "modes = " + std::to_string(modes) + ", want >= 0";
  if (!(explained > 0 && explained <= 1)) return "explained = " + std::to_string(explained) + ", want > 0 and <= 1";
  return std::nullopt;
}

std::optional<TrainedBody> trainBody(const PostureTemplate& reference, const std::vector<Vertices>& registrations,
                                     const BodyTrainingOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  if (registrations.size() < 2)
    throw InvalidInput("registrations", "has " + std::to_string(registrations.size()) + ", want at least two");
  auto normalised = normalisedAll(reference, registrations, options);
  if (options.stop.stop_requested()) return std::nullopt;
  const LinearPca pca = linearPca(normalised);
  if (pca.values.size() == 0 || !(pca.values[0] > 0))
    throw InvalidInput("registrations", "are all the same shape: there is nothing to learn");
  const RigidMotion upright = alignRigidly(pca.mean, reference.rest);
  const Eigen::Index kept = modesToKeep(pca.values, options);
  const auto& rig = reference.rig;
  BodyModel model({reference.topology, apply(upright, pca.mean), turned(pca.modes.leftCols(kept), upright.rotation),
                   pca.values.head(kept).cwiseSqrt(), rig.skeleton, rig.weights, reference.regressor, rig.limits});
  return TrainedBody{std::move(model), pca.values, std::move(normalised)};
}

PostureTemplate makePostureTemplate(TopologyPtr topology, const Vertices& rest, Rig rig) {
  requireValidShape(*topology, rest, "template");
  JointRegressor regressor = clusterRegressor(rig, rest);
  return {std::move(topology), rest, std::move(rig), std::move(regressor)};
}

Rig rigidRig(const Vertices& rest) {
  SkinWeights weights(rest.rows(), 1);
  for (Eigen::Index v = 0; v < rest.rows(); ++v) weights.insert(v, 0) = 1;
  weights.makeCompressed();
  return {Skeleton({{"root", -1}}), rest.colwise().mean(), std::move(weights), std::nullopt};
}

}  // namespace shaped
